// A cloth that blows up is stopped at its last good state and touches no other.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class FaultTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, FaultTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Two particles on an undamped spring with h^2 k (w_i + w_j) = 100, 25 times the limit: the stretch
// grows by about (98 + sqrt(98^2 - 4)) / 2 = 98 per substep, 0.01 m to 1e5 m/s within 4 substeps of
// 1 ms.
Scene RunawaySpring() {
  Scene scene = Particles({{{0, 0, 0}, {1.01, 0, 0}}, {1, 1}, {}, {{0, 1, 1, 5e7, 0}}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings.time_step_s = 0.001;
  scene.parameters.settings.substeps = 1;
  return scene;
}

TEST_P(FaultTest, SpringsBeyondTheirLimitWarnThenFaultAtTheLastGoodState) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = RunawaySpring();
  const ClothHandle cloth = CreateCloth(backend, scene);
  std::string last_good = ReadBits(backend, cloth);
  StepReport report;
  uint32_t steps = 0;
  for (; steps < 20; ++steps) {
    report = StepAlone(backend, cloth, scene);
    EXPECT_TRUE(report.warnings.springs_beyond_limit);
    if (report.fault != FaultReason::kNone) break;
    last_good = ReadBits(backend, cloth);
  }
  EXPECT_GT(steps, 0u) << "the first step is still good";
  EXPECT_EQ(report.fault, FaultReason::kRunaway);
  EXPECT_FALSE(FaultReasonText(report.fault).empty());
  EXPECT_EQ(ReadBits(backend, cloth), last_good);
  EXPECT_TRUE(IsFinite(ReadState(backend, cloth)));

  // It stays as it is and reports the fault again.
  report = StepAlone(backend, cloth, scene);
  EXPECT_EQ(report.fault, FaultReason::kRunaway);
  EXPECT_EQ(ReadBits(backend, cloth), last_good);
  backend.Destroy(cloth);
}

// Along a diagonal the speed is 1.7 times its components.
TEST_P(FaultTest, TheSpeedCountsNotItsComponents) {
  Backend& backend = SharedBackend(GetParam());
  for (const double share : {0.5, 0.57, 0.59, 0.9}) {
    Scene scene = SizedCloth(1, false);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.settings.time_step_s = 1e-3;
    scene.state.velocities_m_per_s[0].setConstant(share * kMaxSpeed_m_per_s);
    const ClothHandle cloth = CreateCloth(backend, scene);
    const StepReport report = StepAlone(backend, cloth, scene);
    EXPECT_EQ(report.fault, share * std::sqrt(3) > 1 ? FaultReason::kRunaway : FaultReason::kNone)
        << share;
    backend.Destroy(cloth);
  }
}

TEST_P(FaultTest, NotFiniteWithinOneStep) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = ExplosiveSheet(5);
  const ClothHandle cloth = CreateCloth(backend, scene);
  const std::string before = ReadBits(backend, cloth);
  const StepReport report = StepAlone(backend, cloth, scene, 1, true);
  EXPECT_EQ(report.fault, FaultReason::kNotFinite);
  EXPECT_EQ(ReadBits(backend, cloth), before);
  EXPECT_EQ(report.measured.max_strain, 0) << "measures the last good state, the rest shape";
  EXPECT_TRUE(std::isfinite(report.measured.kinetic_energy_j));
  EXPECT_TRUE(std::isfinite(report.measured.max_residual_m));
  backend.Destroy(cloth);
}

TEST_P(FaultTest, WritingAStateRevives) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = ExplosiveSheet(5);
  const ClothHandle cloth = CreateCloth(backend, scene);
  ASSERT_NE(StepAlone(backend, cloth, scene).fault, FaultReason::kNone);

  ClothUpdate only_parameters;
  only_parameters.parameters = scene.parameters;
  ASSERT_TRUE(backend.Write(cloth, only_parameters).ok());
  EXPECT_NE(StepAlone(backend, cloth, scene).fault, FaultReason::kNone)
      << "only a new state clears a fault";

  const Scene tame = Grid(5, 5, 1, 1);
  ClothUpdate update;
  update.model = tame.model;
  update.state = tame.state;
  ASSERT_TRUE(backend.Write(cloth, update).ok());
  const StepReport report = StepAlone(backend, cloth, tame);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  EXPECT_LT(ReadState(backend, cloth).positions_m[12].y(), 0) << "falls again";
  backend.Destroy(cloth);
}

TEST_P(FaultTest, NeighboursOfAFaultKeepTheirBits) {
  Backend& backend = SharedBackend(GetParam());
  Scene scene = CompliantSheet(8, 1e-5);
  Stir(scene, 0.5);
  const ClothHandle alone = CreateCloth(backend, scene);
  StepAlone(backend, alone, scene, 3);
  const std::string expected = ReadBits(backend, alone);
  backend.Destroy(alone);

  const Scene explosive = ExplosiveSheet(8);
  std::vector<StepItem> items;
  for (int k = 0; k < 7; ++k) {
    items.push_back({CreateCloth(backend, k % 2 == 0 ? explosive : scene), {}, false});
  }
  for (int step = 0; step < 3; ++step) {
    const BatchReport report = backend.Step(items);
    for (size_t k = 0; k < items.size(); ++k) {
      EXPECT_EQ(report.reports[k].fault != FaultReason::kNone, k % 2 == 0);
    }
  }
  for (size_t k = 1; k < items.size(); k += 2) {
    EXPECT_EQ(ReadBits(backend, items[k].cloth), expected) << "neighbour " << k;
  }
  for (const StepItem& item : items) backend.Destroy(item.cloth);
}

}  // namespace
}  // namespace drape::test
