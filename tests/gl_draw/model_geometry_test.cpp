#include "server/render/gl_draw/model_geometry.h"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>
#include <tuple>

#include "shaders/interface/draw_bindings.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

TEST(ModelGeometryTest, EveryTriangleIsFoundFromEachCornerInItsSense) {
  const auto model = GridModel(5);
  const ModelGeometry geometry = BuildGeometry(*model);
  const GeometryLayout& layout = geometry.layout;
  ASSERT_EQ(geometry.indices.size(), 3 * model->triangles().size());
  std::multiset<std::tuple<uint32_t, uint32_t, uint32_t>> found;
  std::multiset<std::tuple<uint32_t, uint32_t, uint32_t>> expected;
  for (uint32_t particle = 0; particle < model->particle_count(); ++particle) {
    const uint32_t* offsets = &geometry.surface[layout.corner_offsets + particle];
    for (uint32_t k = offsets[0]; k < offsets[1]; ++k) {
      const uint32_t* others = &geometry.surface[layout.corners + DRAPE_DRAW_CORNER_WORDS * k];
      found.insert({particle, others[0], others[1]});
    }
  }
  for (const auto& [a, b, c] : model->triangles()) {
    expected.insert({a, b, c});
    expected.insert({b, c, a});
    expected.insert({c, a, b});
  }
  EXPECT_EQ(found, expected);
}

TEST(ModelGeometryTest, ConstraintsComeWithTheirGroupsAndEnds) {
  const auto model = GridModel(4, 1, {2, 5});
  const ModelGeometry geometry = BuildGeometry(*model);
  const GeometryLayout& layout = geometry.layout;
  std::multimap<uint32_t, std::pair<uint32_t, uint32_t>> expected_ends;
  for (uint32_t colour = 0; colour < model->colour_count(); ++colour) {
    for (uint32_t k = model->colour_offsets()[colour]; k < model->colour_offsets()[colour + 1];
         ++k) {
      const uint32_t* words =
          &geometry.constraints[layout.constraints + DRAPE_DRAW_CONSTRAINT_WORDS * k];
      const DistanceConstraint& constraint = model->constraints()[k];
      EXPECT_EQ(words[0], constraint.i);
      EXPECT_EQ(words[1], constraint.j);
      EXPECT_EQ(words[2], colour);
      const auto bits = std::bit_cast<uint32_t>(static_cast<float>(constraint.rest_length_m));
      expected_ends.insert({constraint.i, {constraint.j, bits}});
      expected_ends.insert({constraint.j, {constraint.i, bits}});
    }
  }
  std::multimap<uint32_t, std::pair<uint32_t, uint32_t>> ends;
  for (uint32_t particle = 0; particle < model->particle_count(); ++particle) {
    const uint32_t* offsets = &geometry.constraints[layout.end_offsets + particle];
    for (uint32_t k = offsets[0]; k < offsets[1]; ++k) {
      const uint32_t* words = &geometry.constraints[layout.ends + DRAPE_DRAW_END_WORDS * k];
      ends.insert({particle, {words[0], words[1]}});
    }
  }
  EXPECT_EQ(ends, expected_ends);
  ASSERT_EQ(geometry.constraints.size(), layout.pins + 2u);
  EXPECT_EQ(geometry.constraints[layout.pins], 2u);
  EXPECT_EQ(geometry.constraints[layout.pins + 1], 5u);
}

TEST(ModelGeometryTest, EndsOfRopesAndStrutsSayWhatTheyAre) {
  ParticleTopology particles;
  particles.positions_m = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  particles.masses_kg = {1, 1, 1};
  particles.distance_constraints = {{0, 1, 1, 0, ConstraintKind::kAtMost},
                                    {1, 2, 1, 0, ConstraintKind::kAtLeast}};
  const auto model = SceneModel::Build({particles, {}, {}}).value();
  const ModelGeometry geometry = BuildGeometry(*model);
  const uint32_t* ends = &geometry.constraints[geometry.layout.ends];
  EXPECT_EQ(ends[0], 1u | DRAPE_DRAW_KIND_AT_MOST);
  EXPECT_EQ(ends[DRAPE_DRAW_END_WORDS * 3], 1u | DRAPE_DRAW_KIND_AT_LEAST);
}

TEST(ModelGeometryTest, NoTrianglesNoSurface) {
  const ModelGeometry geometry = BuildGeometry(*ChainModel(4));
  EXPECT_TRUE(geometry.indices.empty());
  EXPECT_TRUE(geometry.surface.empty());
  EXPECT_EQ(geometry.constraints.size(), 5u + 2 * 2 * 3 + 3 * 3);
}

}  // namespace
}  // namespace drape::render
