#include "server/scene/start_positions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/scene/scene_model.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

std::shared_ptr<const SceneModel> Build(ParticleTopology particles, std::vector<uint32_t> pins) {
  auto model = SceneModel::Build({std::move(particles), {}, std::move(pins)});
  EXPECT_TRUE(model.ok()) << model.status().ToString();
  return *model;
}

// A sheet of side x side particles, hung by two corners, described at positions that `change` makes
// of those of its lengths.
template <class Change>
std::shared_ptr<const SceneModel> Sheet(uint32_t side, const Change& change) {
  const double link_m = 1.0 / (side - 1);
  ParticleTopology particles;
  particles.masses_kg.assign(size_t{side} * side, 0.001);
  for (uint32_t i = 0; i < side * side; ++i) {
    particles.positions_m.emplace_back(link_m * (i % side), 0, link_m * (i / side));
    if (i % side > 0) particles.distance_constraints.push_back({i - 1, i, link_m, 0});
    if (i >= side) particles.distance_constraints.push_back({i - side, i, link_m, 0});
  }
  // Pins that are a little nearer than the cloth is long: a taut row could not move.
  for (Vector3d& p : particles.positions_m) p.x() *= 0.95;
  for (uint32_t i = 1; i < particles.positions_m.size(); ++i) {
    if (i != side - 1) particles.positions_m[i] = change(particles.positions_m[i]);
  }
  return Build(particles, {0, side - 1});
}

void ExpectRestored(const SceneModel& model) {
  ASSERT_TRUE(model.is_start_restored());
  EXPECT_LE(model.start_errors().max, kRestoredError);
  const auto errors = FindLengthErrors(model.length_demands(), model.start_positions_m());
  EXPECT_EQ(errors.max, model.start_errors().max);
  for (const uint32_t pin : model.pins()) {
    EXPECT_EQ(model.start_positions_m()[pin], model.rest_positions_m()[pin]);
  }
}

TEST(StartPositions, StayAsDescribedUpToTheErrorsOfASimulation) {
  const auto stretched = [](double factor) {
    return Build({{{0, 0, 0}, {factor, 0, 0}}, {1, 1}, {{0, 1, 1, 0}}, {}}, {});
  };
  EXPECT_FALSE(stretched(1)->is_start_restored());
  EXPECT_FALSE(stretched(1 + 0.9 * kMaxStartRmsError)->is_start_restored());
  EXPECT_EQ(stretched(1.01)->start_positions_m()[1], Vector3d(1.01, 0, 0));
  EXPECT_TRUE(stretched(1 + 1.1 * kMaxStartRmsError)->is_start_restored());
}

// One wrong link among many counts by its own error.
TEST(StartPositions, OneLinkIsEnough) {
  ParticleTopology particles;
  particles.masses_kg.assign(2001, 0.01);
  for (uint32_t i = 0; i <= 2000; ++i) {
    particles.positions_m.emplace_back(0.1 * i, 0, 0);
    if (i > 0) particles.distance_constraints.push_back({i - 1, i, 0.1, 0});
  }
  particles.positions_m.back().x() += 0.05;
  const auto model = Build(particles, {0});
  EXPECT_LT(model->rest_errors().rms, kMaxStartRmsError);
  EXPECT_NEAR(model->rest_errors().max, 0.5, 1e-6);
  ExpectRestored(*model);
}

// Without pins the least motion keeps the centre of mass, and each particle moves by its share.
TEST(StartPositions, LightParticlesMoveMore) {
  const auto model = Build({{{0, 0, 0}, {2, 0, 0}}, {1, 3}, {{0, 1, 1, 0}}, {}}, {});
  ASSERT_TRUE(model->is_start_restored());
  EXPECT_NEAR((model->start_positions_m()[0] - Vector3d(0.75, 0, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((model->start_positions_m()[1] - Vector3d(1.75, 0, 0)).norm(), 0, 1e-6);
}

TEST(StartPositions, StretchedSheet) {
  ExpectRestored(*Sheet(12, [](const Vector3d& p) { return Vector3d(2 * p); }));
}
TEST(StartPositions, CompressedSheet) {
  ExpectRestored(*Sheet(12, [](const Vector3d& p) { return Vector3d(0.5 * p); }));
}
TEST(StartPositions, SheetAtAPoint) {
  ExpectRestored(*Sheet(12, [](const Vector3d& p) { return Vector3d(1e-9 * p); }));
}
// No motion along the line leads away from it.
TEST(StartPositions, SheetOnALine) {
  ExpectRestored(*Sheet(12, [](const Vector3d& p) { return Vector3d(p.x(), 0, 1e-9 * p.z()); }));
}
TEST(StartPositions, ParticleFarAway) {
  const auto model = Sheet(32, [](const Vector3d& p) {
    return p.z() > 0.99 && p.x() > 0.94 ? Vector3d(100, -50, 80) : p;
  });
  ExpectRestored(*model);
  double largest = 0;
  for (const Vector3d& p : model->start_positions_m()) largest = std::max(largest, p.norm());
  EXPECT_LT(largest, 2) << "within reach of the pins";
}

TEST(StartPositions, RopesStrutsAndJoints) {
  const auto model = Build({{{0, 0, 0}, {3, 0, 0}, {0.2, 1, 0}, {3.5, 0, 0}, {0, 0, 1}},
                            {1, 1, 1, 1, 1},
                            {{0, 1, 1, 0, ConstraintKind::kAtMost},
                             {0, 2, 2, 0, ConstraintKind::kAtLeast},
                             {0, 4, 2, 0, ConstraintKind::kAtMost}},
                            {},
                            {{1, 3, 0}}},
                           {0});
  ExpectRestored(*model);
  const auto x = model->start_positions_m();
  EXPECT_NEAR((x[1] - x[0]).norm(), 1, 1e-5);
  EXPECT_NEAR((x[2] - x[0]).norm(), 2, 1e-5);
  EXPECT_NEAR((x[3] - x[1]).norm(), 0, 1e-5);
  EXPECT_EQ(x[4], Vector3d(0, 0, 1)) << "a slack rope demands nothing";
}

// Compliant links may start under tension.
TEST(StartPositions, CompliantLinksStayAsDescribed) {
  const auto model = Build({{{0, 0, 0}, {2, 0, 0}}, {1, 1}, {{0, 1, 1, 1e-3}}, {}}, {});
  EXPECT_FALSE(model->is_start_restored());
  EXPECT_EQ(model->rest_errors().max, 0);
}

TEST(StartPositions, ContradictionsAreMetAsWellAsFound) {
  const auto model = Build({{{0, 0, 0}, {1, 0, 0}, {2, 0.1, 0}},
                            {1, 1, 1},
                            {{0, 1, 1, 0}, {1, 2, 1, 0}, {0, 2, 3, 0}},
                            {}},
                           {0});
  ASSERT_TRUE(model->is_start_restored());
  EXPECT_LE(model->start_errors().rms, model->rest_errors().rms);
  EXPECT_GT(model->start_errors().max, 0.1) << "no triangle has sides of 1, 1 and 3";
  for (const Vector3d& p : model->start_positions_m()) EXPECT_TRUE(p.allFinite());
}

TEST(StartPositions, AreTheSameEveryTime) {
  const auto squeeze = [](const Vector3d& p) { return Vector3d(p.x(), 0, 1e-9 * p.z()); };
  const auto a = Sheet(8, squeeze), b = Sheet(8, squeeze);
  for (uint32_t i = 0; i < a->particle_count(); ++i) {
    EXPECT_EQ(a->start_positions_m()[i], b->start_positions_m()[i]);
  }
}

}  // namespace
}  // namespace drape::test
