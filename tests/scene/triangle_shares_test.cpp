#include "server/scene/triangle_shares.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/scene_model.h"

namespace drape {
namespace {

using testing::ElementsAre;

std::shared_ptr<const SceneModel> Build(const Topology& topology) {
  ModelDescription description;
  description.topology = topology;
  const auto model = SceneModel::Build(description);
  EXPECT_TRUE(model.ok()) << model.status().ToString();
  return model.ok() ? *model : nullptr;
}

// Two triangles of different size that share the edge 1-2.
TEST(TriangleSharesTest, ListsTheTrianglesOfEachParticleAscending) {
  const auto model =
      Build(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {3, 0, 3}}, {{0, 2, 1}, {1, 2, 3}}});
  EXPECT_THAT(model->triangle_offsets(), ElementsAre(0, 1, 3, 5, 6));
  EXPECT_THAT(model->particle_triangles(), ElementsAre(0, 0, 1, 0, 1, 1));
}

// A vertex of a mesh carries a third of each triangle, so each triangle gets its own mass back.
TEST(TriangleSharesTest, OfAMeshOfUniformDensityAreTheMassesOfTheTriangles) {
  const auto model =
      Build(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {3, 0, 3}}, {{0, 2, 1}, {1, 2, 3}}});
  ASSERT_EQ(model->triangle_masses_kg().size(), 2u);
  EXPECT_NEAR(model->triangle_masses_kg()[0], 0.2 * 0.5, 1e-15);
  EXPECT_NEAR(model->triangle_masses_kg()[1], 0.2 * 2.5, 1e-15);
}

// A flat grid that the air meets broadside changes its velocity everywhere alike: each particle
// gives all of its mass, and all triangles have the density of the cloth.
TEST(TriangleSharesTest, OfAGridAreWholeEverywhere) {
  const auto model = Build(GridTopology{.columns = 7, .rows = 4, .width_m = 1, .height_m = 2});
  for (const double mass_kg : model->triangle_masses_kg()) {
    EXPECT_NEAR(mass_kg, 0.2 * 1 * 2 / (2 * 6 * 3), 1e-15);
  }
  for (uint32_t i = 0; i < model->particle_count(); ++i) {
    double given_kg = 0;
    for (uint32_t e = model->triangle_offsets()[i]; e < model->triangle_offsets()[i + 1]; ++e) {
      given_kg +=
          model->triangle_masses_kg()[model->particle_triangles()[e]] * model->corner_shares()[i];
    }
    EXPECT_NEAR(given_kg, model->masses_kg()[i], 1e-15) << i;
  }
}

// This keeps the air from ever taking more than a particle has.
TEST(TriangleSharesTest, PromiseNoParticleTwice) {
  const auto model = Build(GridTopology{.columns = 7, .rows = 4, .width_m = 1, .height_m = 2});
  for (uint32_t i = 0; i < model->particle_count(); ++i) {
    double promised_kg = 0;
    for (uint32_t e = model->triangle_offsets()[i]; e < model->triangle_offsets()[i + 1]; ++e) {
      promised_kg +=
          model->triangle_masses_kg()[model->particle_triangles()[e]] * model->corner_shares()[i];
    }
    EXPECT_LE(promised_kg, model->masses_kg()[i] * (1 + 1e-15)) << i;
    EXPECT_GT(promised_kg, 0) << i;
  }
}

TEST(TriangleSharesTest, ParticlesWithoutTrianglesHaveNone) {
  const auto line = Build(GridTopology{.columns = 5, .rows = 1, .width_m = 1, .height_m = 1});
  EXPECT_TRUE(line->particle_triangles().empty());
  EXPECT_THAT(line->triangle_offsets(), ElementsAre(0, 0, 0, 0, 0, 0));
  EXPECT_TRUE(line->triangle_masses_kg().empty());
}

}  // namespace
}  // namespace drape
