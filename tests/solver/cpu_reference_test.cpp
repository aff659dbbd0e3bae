// The reference backend: its formulas against numbers worked out by hand, and the Backend contract.
// Properties of all backends are in tests/parity and tests/physics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/solver/cpu_reference/reference_backend.h"
#include "server/solver/cpu_reference/reference_contact.h"
#include "server/solver/cpu_reference/reference_measure.h"
#include "server/solver/cpu_reference/reference_springs.h"
#include "server/solver/cpu_reference/reference_step.h"
#include "server/solver/solver_constants.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using test::Scene;

ReferenceCloth ClothOf(const Scene& scene) {
  std::vector<Vector3d> targets;
  for (const uint32_t pin : scene.model->pins()) targets.push_back(scene.state.positions_m[pin]);
  return {scene.model, scene.parameters, scene.state, targets, FaultReason::kNone};
}

// Particles 0 (1 kg) and 1 (3 kg), 2 m apart along x, joined at the given rest length.
Scene Dumbbell(double rest_length_m, double compliance_m_per_n) {
  ParticleTopology pair;
  pair.positions_m = {Vector3d(0, 0, 0), Vector3d(2, 0, 0)};
  pair.masses_kg = {1, 3};
  pair.distance_constraints = {{0, 1, rest_length_m, compliance_m_per_n}};
  Scene scene = test::Particles(pair);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings.time_step_s = 0.5;
  scene.parameters.settings.substeps = 1;
  return scene;
}

// C = 2 - 1.6 = 0.4 m, h = 0.5 s: the impulse -0.4 / 0.5 / (1 + 1/3) = -0.6 N s gives 0.6 and -0.2
// m/s.
TEST(ReferenceStep, OneImpulseByHand) {
  ReferenceCloth cloth = ClothOf(Dumbbell(1.6, 0));
  StepReferenceCloth(cloth, {}, cloth.parameters.settings.max_iterations);
  EXPECT_DOUBLE_EQ(cloth.state.velocities_m_per_s[0].x(), 0.6);
  EXPECT_DOUBLE_EQ(cloth.state.velocities_m_per_s[1].x(), -0.2);
  EXPECT_DOUBLE_EQ(cloth.state.positions_m[0].x(), 0.3);
  EXPECT_DOUBLE_EQ(cloth.state.positions_m[1].x(), 1.9);
}

// alpha / h^2 = 0.5 / 0.25 = 2: the impulse is -0.8 / (4/3 + 2) = -0.24 N s. A second sweep must
// find C + alpha/h lambda = 0.4 - 0.5 * 0.24 * 4/3 - 0.24 = 0 and change nothing.
TEST(ReferenceStep, OneCompliantImpulseByHandAtAnyNumberOfSweeps) {
  for (const uint32_t sweeps : {1u, 5u}) {
    Scene scene = Dumbbell(1.6, 0.5);
    scene.parameters.settings.max_iterations = sweeps;
    ReferenceCloth cloth = ClothOf(scene);
    const StepReport report =
        StepReferenceCloth(cloth, {.measure = true}, cloth.parameters.settings.max_iterations);
    EXPECT_NEAR(cloth.state.velocities_m_per_s[0].x(), 0.24, 4e-16);
    EXPECT_NEAR(cloth.state.velocities_m_per_s[1].x(), -0.08, 2e-16);
    EXPECT_NEAR(report.measured.max_residual_m, 0, 1e-15);
  }
}

TEST(ReferenceStep, CoincidentParticlesArePushedApartAlongX) {
  Scene scene = Dumbbell(1, 0);
  scene.state.positions_m[1] = scene.state.positions_m[0];
  ReferenceCloth cloth = ClothOf(scene);
  StepReferenceCloth(cloth, {}, cloth.parameters.settings.max_iterations);
  const Vector3d d = cloth.state.positions_m[1] - cloth.state.positions_m[0];
  EXPECT_LE((d - Vector3d(1, 0, 0)).norm(), 4e-16);
}

TEST(ReferenceContact, GapsAndNormalsOfPlaneAndSphere) {
  const Collider plane = PlaneThrough({0, -1, 0}, {0, 1, 0});
  EXPECT_DOUBLE_EQ(ContactAt(plane, 0.25, {5, 0.5, 7}).gap, 1.25);
  EXPECT_EQ(ContactAt(plane, 0.25, {5, 0.5, 7}).normal, Vector3d::UnitY());
  const Collider sphere = SphereAt({1, 0, 0}, 2);
  EXPECT_DOUBLE_EQ(ContactAt(sphere, 0, {1, 0, -3}).gap, 1);
  EXPECT_EQ(ContactAt(sphere, 0, {1, 0, -3}).normal, -Vector3d::UnitZ());
  EXPECT_DOUBLE_EQ(ContactAt(sphere, 0.5, {1, 0, 0}).gap, -2.5) << "the centre";
  EXPECT_EQ(ContactAt(sphere, 0, {1, 0, 0}).normal, Vector3d::UnitY());
}

TEST(FrictionImpulse, GivesWhatIsWantedUpToTheLimit) {
  const Vector3d wanted(0.3, 0, 0.4);  // 0.5
  EXPECT_EQ(FrictionImpulse(wanted, 1, 0.5), wanted) << "at the limit";
  const Vector3d granted = FrictionImpulse(wanted, 0.9, 0.25);
  EXPECT_LE((granted - wanted * (0.25 * 0.9 / 0.5)).norm(), 1e-16);
  EXPECT_EQ(FrictionImpulse(wanted, 0, 0.5), Vector3d::Zero()) << "nothing presses";
  EXPECT_EQ(FrictionImpulse(wanted, 3, 0), Vector3d::Zero()) << "no friction";
  EXPECT_EQ(FrictionImpulse(Vector3d::Zero(), 0, 0), Vector3d::Zero());
}

TEST(SlipSpeed, IsWhatStaticFrictionStopsInSixSubstepsButNoMoreThanFiveCentimetresPerSecond) {
  EXPECT_DOUBLE_EQ(SlipSpeed(0.5, 0.002, 0.003), 0.009) << "the weight";
  EXPECT_DOUBLE_EQ(SlipSpeed(0.5, 0.01, 0.003), 0.03) << "the pressure";
  EXPECT_DOUBLE_EQ(SlipSpeed(0.5, 10, 0.003), 0.05);
  EXPECT_EQ(SlipSpeed(0, 10, 0.003), 0);
}

// k (|d| - l0) + c (v_j - v_i).d = 10 (2 - 1.5) + 2 (-0.25) = 4.5 N towards each other.
TEST(SpringAccelerations, ByHand) {
  ParticleTopology pair;
  pair.positions_m = {Vector3d(0, 0, 0), Vector3d(0, 2, 0), Vector3d(0, 0, 0)};
  pair.masses_kg = {1, 3, 1};
  pair.springs = {{0, 1, 1.5, 10, 2}, {0, 2, 1, 1000, 0}};
  const Scene scene = test::Particles(pair);
  ParticleState state = scene.state;
  state.velocities_m_per_s[1] = Vector3d(7, -0.25, 0);
  const auto accelerations = SpringAccelerations(*scene.model, state);
  EXPECT_EQ(accelerations[0], Vector3d(0, 4.5, 0));
  EXPECT_EQ(accelerations[1], Vector3d(0, -1.5, 0));
  EXPECT_EQ(accelerations[2], Vector3d::Zero()) << "a spring without length has no direction";
}

// A chain of equal masses and springs reaches the bound: omega^2 -> 4 k / m.
TEST(SpringsBeyondLimit, TellsTheStepAtWhichAChainBlowsUp) {
  ParticleTopology chain;
  for (uint32_t i = 0; i < 50; ++i) {
    chain.positions_m.emplace_back(i, 0.01 * (i % 2), 0);
    chain.masses_kg.push_back(0.5);
    if (i > 0) chain.springs.push_back({i - 1, i, 1, 200, 0});
  }
  Scene scene = test::Particles(chain);
  scene.parameters.gravity_m_per_s2.setZero();
  const double limit = 2 / std::sqrt(4 * 200 / 0.5);  // 0.05 s
  const auto is_beyond = [&](double substep_s) {
    scene.parameters.settings.time_step_s = substep_s;
    scene.parameters.settings.substeps = 1;
    return PlanOf(scene).known_warnings.springs_beyond_limit;
  };
  EXPECT_FALSE(is_beyond(0.99 * limit));
  EXPECT_TRUE(is_beyond(1.01 * limit));
  for (const double share : {0.95, 1.02}) {
    scene.parameters.settings.time_step_s = share * limit;
    scene.parameters.settings.substeps = 1;
    for (uint32_t i = 0; i < 50; ++i) {
      scene.state.velocities_m_per_s[i] = Vector3d(i % 2 == 0 ? 1e-3 : -1e-3, 0, 0);
    }
    ReferenceCloth cloth = ClothOf(scene);
    StepReport report;
    for (int step = 0; step < 20; ++step)
      report =
          StepReferenceCloth(cloth, {.measure = true}, cloth.parameters.settings.max_iterations);
    EXPECT_EQ(report.warnings.springs_beyond_limit, share > 1);
    // 1e-3 m/s of 25 kg are 1.25e-5 J at first. Below the limit an amplitude grows by at most
    // 1 / sqrt(1 - 0.95^2) = 3.2, beyond it each step by (1.02 + sqrt(1.02^2 - 1))^2 = 1.49.
    EXPECT_EQ(report.measured.kinetic_energy_j > 1e-3, share > 1) << share;
  }
}

TEST(MeasureState, ByHand) {
  ParticleTopology particles;
  particles.positions_m = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, -2, 0)};
  particles.masses_kg = {1, 2, 4};
  particles.distance_constraints = {{0, 1, 1, 0}, {0, 2, 2, 0.01}};
  particles.springs = {{0, 2, 1, 6, 0}};
  Scene scene = test::Particles(particles);
  scene.parameters.gravity_m_per_s2 = Vector3d(0, -10, 0);
  scene.parameters.colliders = {PlaneThrough({0, -1.75, 0}, {0, 1, 0}),
                                PlaneThrough({0, -1, 0}, {0, 1, 0})};
  scene.state.positions_m[1] = Vector3d(1.25, 0, 0);
  scene.state.positions_m[2] = Vector3d(0, -2.1, 0);
  scene.state.velocities_m_per_s[1] = Vector3d(3, 0, 4);
  const Measurements m = MeasureState(*scene.model, scene.parameters, scene.state);
  EXPECT_DOUBLE_EQ(m.max_strain, 0.25);
  EXPECT_DOUBLE_EQ(m.rms_strain, std::sqrt((0.25 * 0.25 + 0.05 * 0.05) / 2));
  // Of two, the first is the median and the second every higher percentile; 0.05 = 1.6 / 2^5, and
  // 1.6 * 2^7 = 204.8.
  EXPECT_EQ(m.strain_p50, 204.0 / (1 << 12));
  EXPECT_EQ(m.strain_p90, 0.25);
  EXPECT_EQ(m.strain_p99, 0.25);
  EXPECT_DOUBLE_EQ(m.kinetic_energy_j, 25);
  EXPECT_DOUBLE_EQ(m.potential_energy_j, -84);
  // Spring 6/2 * 1.1^2, constraint 0.1^2 / 0.02; the inextensible one has no energy.
  EXPECT_NEAR(m.strain_energy_j, 3.63 + 0.5, 1e-14);
  EXPECT_DOUBLE_EQ(m.lowest_m, -2.1);
  EXPECT_EQ(m.contacts, 1u) << "each particle once";
  EXPECT_DOUBLE_EQ(m.max_penetration_m, 1.1);
}

ClothUpdate WithState(const ParticleState& state) {
  ClothUpdate update;
  update.state = state;
  return update;
}

ClothUpdate WithModel(std::shared_ptr<const SceneModel> model) {
  ClothUpdate update;
  update.model = std::move(model);
  return update;
}

ClothUpdate WithParameters(const ClothParameters& parameters) {
  ClothUpdate update;
  update.parameters = parameters;
  return update;
}

class ReferenceBackendTest : public ::testing::Test {
 protected:
  std::unique_ptr<Backend> backend_ = CreateReferenceBackend();
};

TEST_F(ReferenceBackendTest, DescribesItself) {
  const BackendDescription description = backend_->Describe();
  EXPECT_EQ(description.name, "reference");
  EXPECT_EQ(description.scalar, ScalarType::kFloat64);
  EXPECT_FALSE(description.is_hardware_gpu);
  EXPECT_EQ(description.plan_of(*test::Grid(3, 3, 1, 1).model, {}), "scalar");
}

TEST_F(ReferenceBackendTest, ReadsWhatIsAskedForInOrder) {
  const Scene a = test::Grid(2, 1, 1, 1);
  Scene b = test::Grid(3, 1, 2, 1);
  b.state.velocities_m_per_s[2] = Vector3d(7, 8, 9);
  const ClothHandle cloths[] = {test::CreateCloth(*backend_, b), test::CreateCloth(*backend_, a)};
  const StateColumns both = backend_->Read({cloths, true, true});
  const auto& positions = std::get<std::vector<double>>(both.positions_m);
  const auto& velocities = std::get<std::vector<double>>(both.velocities_m_per_s);
  ASSERT_EQ(positions.size(), 15u);
  EXPECT_EQ(positions[6], 2) << "x of the last particle of the first cloth asked for";
  EXPECT_EQ(positions[12], 1) << "x of the last particle of the second";
  EXPECT_EQ(velocities[8], 9);
  const StateColumns none = backend_->Read({cloths, false, false});
  EXPECT_TRUE(std::get<std::vector<double>>(none.positions_m).empty());
  EXPECT_TRUE(std::get<std::vector<double>>(none.velocities_m_per_s).empty());
}

TEST_F(ReferenceBackendTest, HandlesAreNeverReused) {
  const Scene scene = test::Grid(2, 1, 1, 1);
  const ClothHandle first = test::CreateCloth(*backend_, scene);
  backend_->Destroy(first);
  const ClothHandle second = test::CreateCloth(*backend_, scene);
  EXPECT_NE(first, second);
  EXPECT_DEATH(backend_->Destroy(first), "no such cloth");
}

TEST_F(ReferenceBackendTest, AFaultedClothKeepsItsLastGoodStateUntilOneIsWritten) {
  const Scene scene = test::Grid(3, 3, 1, 1);
  const ClothHandle cloth = test::CreateCloth(*backend_, scene);
  test::StepAlone(*backend_, cloth, scene, 3);
  const std::string good = test::ReadBits(*backend_, cloth);
  for (const double speed : {std::numeric_limits<double>::quiet_NaN(), 2e5}) {
    ParticleState bad = test::ReadState(*backend_, cloth);
    const ParticleState before = bad;
    for (Vector3d& v : bad.velocities_m_per_s) v.x() = speed;
    ASSERT_TRUE(backend_->Write(cloth, WithState(bad)).ok());
    const std::string written = test::ReadBits(*backend_, cloth);
    for (int step = 0; step < 2; ++step) {
      const StepReport report = test::StepAlone(*backend_, cloth, scene);
      EXPECT_EQ(report.fault, std::isnan(speed) ? FaultReason::kNotFinite : FaultReason::kRunaway);
      EXPECT_EQ(test::ReadBits(*backend_, cloth), written) << "the state from before the step";
    }
    ASSERT_TRUE(backend_->Write(cloth, WithState(before)).ok());
    EXPECT_EQ(test::ReadBits(*backend_, cloth), good);
  }
  EXPECT_EQ(test::StepAlone(*backend_, cloth, scene).fault, FaultReason::kNone);
}

TEST_F(ReferenceBackendTest, ANewModelKeepsTheStateAndTheTargetsOfItsPins) {
  const Scene scene = test::Grid(4, 1, 3, 1, {0});
  const ClothHandle cloth = test::CreateCloth(*backend_, scene);
  const Vector3d target(0.1, 0, 0);
  const StepItem item{cloth, {&target, 1}, false};
  backend_->Step({&item, 1});
  const ParticleState before = test::ReadState(*backend_, cloth);

  const Scene two_pins = test::Grid(4, 1, 3, 1, {0, 3});
  ASSERT_TRUE(backend_->Write(cloth, WithModel(two_pins.model)).ok());
  test::StepAlone(*backend_, cloth, scene);
  const ParticleState after = test::ReadState(*backend_, cloth);
  EXPECT_EQ(after.positions_m[0], target) << "keeps its target";
  EXPECT_EQ(after.positions_m[3], before.positions_m[3]) << "is pinned where it was";
}

TEST_F(ReferenceBackendTest, AResultDoesNotDependOnTheRestOfTheBatch) {
  Scene scene = test::FallingOnSphere(6);
  test::Stir(scene, 0.5);
  const Scene other = test::Net(4, 0.1, 1e-4);
  Scene broken = other;
  broken.state.velocities_m_per_s[5].y() = std::numeric_limits<double>::quiet_NaN();
  const ClothHandle alone = test::CreateCloth(*backend_, scene);
  const ClothHandle second = test::CreateCloth(*backend_, broken);
  const ClothHandle in_batch = test::CreateCloth(*backend_, scene);
  const ClothHandle last = test::CreateCloth(*backend_, other);
  for (int step = 0; step < 10; ++step) {
    test::StepAlone(*backend_, alone, scene);
    const StepItem items[] = {{second, {}, true}, {in_batch, {}, true}, {last, {}, false}};
    const BatchReport batch = backend_->Step(items);
    ASSERT_EQ(batch.reports.size(), 3u);
    EXPECT_EQ(batch.dispatch_count, 0u);
    EXPECT_EQ(batch.reports[0].fault, FaultReason::kNotFinite);
    EXPECT_EQ(batch.reports[1].fault, FaultReason::kNone);
  }
  EXPECT_EQ(test::ReadBits(*backend_, in_batch), test::ReadBits(*backend_, alone));
}

TEST_F(ReferenceBackendTest, SnapshotRestoreStepIsStepBitForBit) {
  Scene scene = test::CompliantSheet(5, 1e-4);
  const ClothHandle cloth = test::CreateCloth(*backend_, scene);
  test::StepAlone(*backend_, cloth, scene, 5);
  const ParticleState snapshot = test::ReadState(*backend_, cloth);
  test::StepAlone(*backend_, cloth, scene, 5);
  const std::string expected = test::ReadBits(*backend_, cloth);
  ASSERT_TRUE(backend_->Write(cloth, WithState(snapshot)).ok());
  test::StepAlone(*backend_, cloth, scene, 5);
  EXPECT_EQ(test::ReadBits(*backend_, cloth), expected);
}

TEST_F(ReferenceBackendTest, TheToleranceIsRaisedOnlyWhereDoublesEnd) {
  Scene scene = test::Grid(3, 3, 1, 1, {0});
  scene.parameters.settings.max_iterations = 2;
  for (const double tolerance : {0.0, 1e-3, 1e-12, 1e-16}) {
    scene.parameters.settings.tolerance = tolerance;
    const ClothHandle cloth = test::CreateCloth(*backend_, scene);
    EXPECT_EQ(test::StepAlone(*backend_, cloth, scene).warnings.tolerance_raised,
              tolerance == 1e-16);
  }
}

TEST_F(ReferenceBackendTest, ParametersCanBeReplacedWhileRunning) {
  Scene scene = test::SizedCloth(1);
  const ClothHandle cloth = test::CreateCloth(*backend_, scene);
  scene.parameters.gravity_m_per_s2 = Vector3d(60, 0, 0);
  ASSERT_TRUE(backend_->Write(cloth, WithParameters(scene.parameters)).ok());
  test::StepAlone(*backend_, cloth, scene);
  const Vector3d v = test::ReadState(*backend_, cloth).velocities_m_per_s[0];
  // 60 substeps of 2 roundings each.
  EXPECT_LE((v - Vector3d(1, 0, 0)).norm(), 120 * 0x1p-53);
}

}  // namespace
}  // namespace drape
