#include "server/scene/tethers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "server/scene/scene_model.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A straight row of particles along +x, a constraint of 1 m between neighbours.
struct Row {
  explicit Row(uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) positions_m.emplace_back(i, 0, 0);
    for (uint32_t i = 0; i + 1 < count; ++i) constraints.push_back({i, i + 1, 1, 0});
  }
  TetherSet Find(const std::vector<uint32_t>& pins) const {
    return FindTethers(positions_m, constraints, joints, pins);
  }

  std::vector<Vector3d> positions_m;
  std::vector<DistanceConstraint> constraints;
  std::vector<PointJoint> joints;
};

std::shared_ptr<const SceneModel> TetheredGrid(uint32_t columns, uint32_t rows,
                                               std::vector<uint32_t> pins) {
  ModelDescription description;
  description.topology = GridTopology{columns, rows, 0.1 * (columns - 1), 0.1 * (rows - 1)};
  description.pinned_particles = std::move(pins);
  return SceneModel::Build(description).value();
}

std::vector<Tether> Of(const TetherSet& set, uint32_t particle) {
  return {set.tethers.begin() + set.offsets[particle],
          set.tethers.begin() + set.offsets[particle + 1]};
}

// "3:2.5": pin 3 within 2.5 m
std::vector<std::string> Texts(const std::vector<Tether>& tethers) {
  std::vector<std::string> texts;
  for (const Tether& tether : tethers) {
    std::ostringstream text;
    text << tether.pin << ":" << tether.length_m;
    texts.push_back(text.str());
  }
  return texts;
}

TEST(TethersTest, WithoutPinsThereAreNone) {
  const TetherSet set = Row(3).Find({});
  EXPECT_THAT(set.offsets, ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(set.tethers, IsEmpty());
}

TEST(TethersTest, AreAsLongAsTheWayAlongTheConstraints) {
  const TetherSet set = Row(4).Find({0});
  EXPECT_THAT(Of(set, 0), IsEmpty()) << "a pin has none";
  EXPECT_THAT(Texts(Of(set, 1)), ElementsAre("0:1"));
  EXPECT_THAT(Texts(Of(set, 3)), ElementsAre("0:3"));
}

TEST(TethersTest, OfAGridAreAsLongAsTheWayAlongItsThreads) {
  const auto model = TetheredGrid(5, 4, {0, 4});
  const TetherSet set{{model->tether_offsets().begin(), model->tether_offsets().end()},
                      {model->tethers().begin(), model->tethers().end()}};
  const std::vector<Tether> tethers = Of(set, 3 * 5 + 1);  // row 3, column 1
  ASSERT_THAT(tethers, SizeIs(2));
  EXPECT_EQ(tethers[0].pin, 0u);
  EXPECT_NEAR(tethers[0].length_m, 0.4, 1e-12);
  EXPECT_EQ(tethers[1].pin, 4u);
  EXPECT_NEAR(tethers[1].length_m, 0.6, 1e-12);
}

TEST(TethersTest, ComeInTheOrderOfTheirPins) {
  Row row(5);
  row.positions_m[4] = {1, 0, 3};  // so that neither pin implies the other
  const TetherSet set = row.Find({4, 0});
  EXPECT_THAT(Texts(Of(set, 1)), ElementsAre("0:1", "4:3"));
  EXPECT_THAT(Texts(Of(set, 2)), ElementsAre("0:2", "4:2"));
  EXPECT_THAT(Texts(Of(set, 3)), ElementsAre("0:3", "4:1"));
}

// A curtain: |p - B| <= |p - A| + |A - B|, so only the pin straight above matters.
TEST(TethersTest, PinsThatANearerOneImpliesAreLeftOut) {
  const auto model = TetheredGrid(6, 5, {0, 1, 2, 3, 4, 5});
  const auto offsets = model->tether_offsets();
  for (uint32_t particle = 6; particle < 30; ++particle) {
    ASSERT_EQ(offsets[particle + 1] - offsets[particle], 1u) << particle;
    EXPECT_EQ(model->tethers()[offsets[particle]].pin, particle % 6);
  }
}

TEST(TethersTest, DoNotLeadThroughOtherPins) {
  EXPECT_THAT(Texts(Of(Row(5).Find({0, 2}), 3)), ElementsAre("2:1"));
}

TEST(TethersTest, ExtensibleConstraintsCarryNone) {
  Row row(4);
  row.constraints[1].compliance_m_per_n = 1e-6;
  const TetherSet set = row.Find({0});
  EXPECT_THAT(Texts(Of(set, 1)), ElementsAre("0:1"));
  EXPECT_THAT(Of(set, 2), IsEmpty());
  EXPECT_THAT(Of(set, 3), IsEmpty());
}

TEST(TethersTest, RopesAndJointsCarryThemStrutsDoNot) {
  Row row(5);
  row.constraints[0].kind = ConstraintKind::kAtMost;
  row.constraints[3].kind = ConstraintKind::kAtLeast;
  row.constraints.erase(row.constraints.begin() + 1);
  row.joints = {{1, 2, 0}};
  const TetherSet set = row.Find({0});
  EXPECT_THAT(Texts(Of(set, 2)), ElementsAre("0:1"));
  EXPECT_THAT(Texts(Of(set, 3)), ElementsAre("0:2"));
  EXPECT_THAT(Of(set, 4), IsEmpty());
  row.joints[0].compliance_m_per_n = 1e-6;
  EXPECT_THAT(Of(row.Find({0}), 2), IsEmpty());
}

// A hub held by many pins on a circle: none implies another.
TEST(TethersTest, AreAtMostFourPerParticle) {
  std::vector<Vector3d> positions_m = {Vector3d::Zero()};
  std::vector<DistanceConstraint> constraints;
  std::vector<uint32_t> pins;
  for (uint32_t k = 1; k <= 12; ++k) {
    positions_m.emplace_back(std::cos(k), std::sin(k), 0);
    constraints.push_back({0, k, 1 + 0.01 * k, 0});
    pins.push_back(k);
  }
  const TetherSet set = FindTethers(positions_m, constraints, {}, pins);
  EXPECT_THAT(Texts(Of(set, 0)), ElementsAre("1:1.01", "2:1.02", "3:1.03", "4:1.04"));
}

// All particles of the rest shape are within reach of the pins.
TEST(TethersTest, HoldInTheRestShape) {
  const auto model = TetheredGrid(13, 9, {0, 12, 60});
  const auto offsets = model->tether_offsets();
  EXPECT_GT(model->tethers().size(), 100u);
  for (uint32_t i = 0; i < model->particle_count(); ++i) {
    for (uint32_t t = offsets[i]; t < offsets[i + 1]; ++t) {
      const Tether& tether = model->tethers()[t];
      const std::span<const Vector3d> p = model->rest_positions_m();
      ASSERT_LE((p[i] - p[tether.pin]).norm(), tether.length_m * (1 + 1e-12)) << i;
    }
  }
}

}  // namespace
}  // namespace drape::test
