// What grips hold (server/solver/method.md, "Grips"): every backend against the reference, and the
// reference against pins.
#include <gtest/gtest.h>

#include "server/solver/solver_constants.h"
#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class GripParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, GripParityTest, testing::ValuesIn(StripBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

void UseSubsteps(Scene& scene, uint32_t substeps) {
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.max_iterations = 2;
  scene.parameters.settings.tolerance = 0;
}

const Vector3d kWay_m{0.004, 0.01, -0.006};

TEST_P(GripParityTest, SheetsByStripsAndColours) {
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    for (const uint32_t side : {9u, 33u}) {  // resident and tiled
      // No row or column is taut between two held particles: rounding would decide what it does.
      Scene scene = Grid(side, side, 0.5, 0.5, {0});
      scene.name = "sheet_" + std::to_string(side);
      Stir(scene, 0.3);
      UseSubsteps(scene, 8);
      scene.parameters.settings.sweep = sweep;
      GripParticles(scene, {2 * side + 6, 5 * side + 3, side * side - 1}, kWay_m);
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

// Two grips beside each other and two cells apart: links that nothing moves.
TEST_P(GripParityTest, NeighboursThatAreBothHeld) {
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    for (const uint32_t side : {9u, 33u}) {
      Scene scene = Grid(side, side, 0.5, 0.5);
      scene.name = "neighbours_" + std::to_string(side);
      UseSubsteps(scene, 4);
      scene.parameters.settings.sweep = sweep;
      scene.parameters.settings.refine_above_strain = 0.002;
      GripParticles(scene, {3 * side + 3, 3 * side + 4, 4 * side + 3});
      scene.grips[1].target_m += kWay_m;  // tears the link between them
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(GripParityTest, CompliantSheetsWithSprings) {
  Scene scene = CompliantSheet(12, 1e-4);
  Stir(scene, 0.3);
  UseSubsteps(scene, 8);
  GripParticles(scene, {60, 143}, kWay_m);
  ExpectParity(GetParam(), scene, 2);
}

TEST_P(GripParityTest, FabricsInTheWind) {
  for (const Integration integration : {Integration::kTwoStep, Integration::kOneStep}) {
    for (const uint32_t side : {12u, 33u}) {
      Scene scene = Grid(side, side, 0.5, 0.5, {0},
                         {.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20});
      scene.name = "fabric_" + std::to_string(side);
      Stir(scene, 0.3);
      UseSubsteps(scene, 8);
      scene.parameters.settings.integration = integration;
      scene.parameters.wind_m_per_s = {2, 1, 4};
      scene.parameters.air_drag = 1.2;
      GripParticles(scene, {side + 1, 7 * side + 6, 8 * side}, kWay_m);
      ExpectParity(GetParam(), scene, 2);
    }
  }
}

TEST_P(GripParityTest, HingesOfMeshes) {
  Scene scene = MeshedGrid(9, 9, 1, 1, {0}, {.bending_rigidity_n_m = 0.5});
  Stir(scene, 0.3);
  UseSubsteps(scene, 8);
  EXPECT_GT(PlanOf(scene).solver.hinge_stages, 1u);
  GripParticles(scene, {40, 80}, kWay_m);
  ExpectParity(GetParam(), scene, 2);
}

TEST_P(GripParityTest, HingesThatShareForces) {
  Scene scene = MeshedGrid(9, 9, 1, 1, {0}, {.bending_rigidity_n_m = 1e-6});
  Stir(scene, 0.3);
  UseSubsteps(scene, 8);
  EXPECT_EQ(PlanOf(scene).solver.hinge_period, kMaxHingePeriod);
  GripParticles(scene, {40, 80}, kWay_m);
  ExpectParity(GetParam(), scene, 2);
}

TEST_P(GripParityTest, UnderTethersTwistDampingAndContacts) {
  Scene scene = FallingOnSphere(12);
  UseSubsteps(scene, 8);
  scene.parameters.settings.use_tethers = true;
  scene.parameters.settings.twist_damping_per_s = 150;
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.8;
  GripParticles(scene, {0, 77, 143}, {0, -0.02, 0});
  ExpectParity(GetParam(), scene, 2);
}

// Colours do not depend on pins: the same sweeps, the same bits.
TEST(GripsOfTheReference, MoveLikePins) {
  const std::vector<uint32_t> held = {10, 16, 90};
  Scene pinned = Grid(11, 9, 0.5, 0.5, held);
  Scene gripped = Grid(11, 9, 0.5, 0.5);
  ASSERT_EQ(pinned.model->constraint_count(), gripped.model->constraint_count());
  for (Scene* scene : {&pinned, &gripped}) {
    UseSubsteps(*scene, 8);
    scene->parameters.settings.sweep = Sweep::kColours;
    scene->parameters.settings.use_tethers = false;
  }
  GripParticles(gripped, held, kWay_m);
  for (const Grip& grip : gripped.grips) pinned.pin_targets_m.push_back(grip.target_m);
  Backend& backend = SharedBackend("reference");
  const ClothHandle of_pins = CreateCloth(backend, pinned);
  const ClothHandle of_grips = CreateCloth(backend, gripped);
  StepAlone(backend, of_pins, pinned, 5);
  StepAlone(backend, of_grips, gripped, 5);
  EXPECT_TRUE(ReadBits(backend, of_pins) == ReadBits(backend, of_grips));
  backend.Destroy(of_pins);
  backend.Destroy(of_grips);
}

class GripsTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, GripsTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// It is where it was asked to be, goes on as fast as it was moved, and falls.
TEST_P(GripsTest, HoldExactlyAndLetGo) {
  Scene scene = Grid(9, 9, 0.4, 0.4);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  GripParticles(scene, {40}, {0, 0.01, 0});
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene);
  const ParticleState held = ReadState(backend, cloth);
  // To the bit, but for the precision of the target.
  EXPECT_LE((held.positions_m[40] - scene.grips[0].target_m).norm(), UnitRoundOff(backend));
  const double speed = 0.01 / scene.parameters.settings.time_step_s;
  EXPECT_NEAR(held.velocities_m_per_s[40].y(), speed, 64 * UnitRoundOff(backend) * speed * 52);
  scene.grips.clear();
  StepAlone(backend, cloth, scene, 30);
  const ParticleState fallen = ReadState(backend, cloth);
  EXPECT_LT(fallen.positions_m[40].y(), held.positions_m[40].y() - 0.3);
  backend.Destroy(cloth);
}

// Grips of others, and room for grips, change no bit.
TEST_P(GripsTest, NoBitDependsOnOtherGrips) {
  const auto bits_beside = [&](uint32_t neighbours, uint32_t max_grips) {
    Scene scene = Grid(9, 9, 0.4, 0.4, {0});
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.max_grips = max_grips;
    Backend& backend = SharedBackend(GetParam());
    std::vector<StepItem> items = {{.cloth = CreateCloth(backend, scene), .pin_targets_m = {}}};
    std::vector<Scene> others(neighbours, scene);
    for (uint32_t k = 0; k < neighbours; ++k) {
      GripParticles(others[k], {7 + k, 60 + k}, kWay_m);
      items.push_back({.cloth = CreateCloth(backend, others[k]),
                       .pin_targets_m = {},
                       .grips = others[k].grips});
    }
    for (int step = 0; step < 3; ++step) backend.Step(items);
    const std::string bits = ReadBits(backend, items[0].cloth);
    for (const StepItem& item : items) backend.Destroy(item.cloth);
    return bits;
  };
  const std::string expected = bits_beside(0, 0);
  EXPECT_TRUE(bits_beside(0, 4) == expected);
  EXPECT_TRUE(bits_beside(7, 4) == expected);
}

// ACCURATE takes one step along start directions on a chain, which would gain energy where a grip
// pulls; with room for grips it does not.
TEST(GripPlanTest, AccurateHasTwoStepsWhereGripsMayPull) {
  Scene scene = Chain(10, 0.05, 0.02);
  scene.parameters.settings = PresetSettings(Preset::kAccurate);
  ASSERT_FALSE(PlanOf(scene).solver.has_two_steps);
  scene.parameters.max_grips = 1;
  EXPECT_TRUE(PlanOf(scene).solver.has_two_steps);
}

}  // namespace
}  // namespace drape::test
