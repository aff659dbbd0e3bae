// The effect of impulses along the links as they were at the start of a substep
// (settings.direction), and of the velocity stage.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "server/solver/load.h"
#include "tests/physics/chain_scene.h"
#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class DirectionTest : public PhysicsTest {
 protected:
  StepSettings OneStep(Direction direction, double duration_s, uint32_t substeps,
                       uint32_t sweeps) const {
    StepSettings settings = SchemeSettings(Preset::kAccurate, duration_s, substeps, sweeps);
    settings.integration = Integration::kOneStep;
    settings.direction = direction;
    return settings;
  }

  // As ChainMotion::Rounding.
  double Rounding(uint32_t substeps) { return 6.0 * substeps * round_off(); }
};

// SHAKE: the error falls with the square of the step, beside a collider too.
TEST_P(DirectionTest, StartDirectionsAreOfSecondOrderBesideAFarCollider) {
  const PlanarChain start = StraightChain(5, 0.2, 0.1, 1.2);
  PlanarChain exact = start;
  exact.AdvanceConverged(0.5, 1e-11);
  for (const bool has_tethers : {false, true}) {
    std::array<double, 3> errors{};
    uint32_t substeps = 120;
    for (double& error : errors) {
      Scene scene = SceneOf(start);
      scene.parameters.colliders = {PlaneThrough({0, -9, 0}, {0, 1, 0})};
      scene.parameters.settings = SchemeSettings(Preset::kAccurate, 0.5, substeps, 60);
      scene.parameters.settings.integration = Integration::kOneStep;
      scene.parameters.settings.use_tethers = has_tethers;
      ASSERT_EQ(PlanOf(scene).solver.end_share, 0);
      error = FindWorst(StateAfter(scene).positions_m, exact.Positions_m()).distance;
      substeps *= 2;
    }
    ExpectOrder(errors, 2, Rounding(substeps / 2));
  }
}

// An impulse along p_j - p_i at the start of the substep has no moment about any point, so angular
// momentum is kept however few sweeps are made. Rounded: each of the substeps rounds velocities in
// up to 4 constraints and sweeps, and positions, as FreeMotion::Rounding counts them.
TEST_P(DirectionTest, StartDirectionsKeepAngularMomentumWithAnyNumberOfSweeps) {
  for (const Sweep sweep : {Sweep::kColours, Sweep::kStrips}) {
    Scene scene = Grid(6, 5, 0.5, 0.4);
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      const Vector3d& p = scene.state.positions_m[i];
      scene.state.velocities_m_per_s[i] = Vector3d(0.3, 2, -1).cross(p);
    }
    Stir(scene, 0.2);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.settings = OneStep(Direction::kAtStart, 0.5, 300, 1);
    scene.parameters.settings.sweep = sweep;
    const auto spin = [&](const ParticleState& state) {
      Vector3d sum = Vector3d::Zero();
      for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
        sum +=
            scene.model->masses_kg()[i] * state.positions_m[i].cross(state.velocities_m_per_s[i]);
      }
      return sum;
    };
    const Vector3d before = spin(scene.state);
    const Vector3d after = spin(StateAfter(scene));
    double size = 0;  // of the terms of the sum
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      size += scene.model->masses_kg()[i] * scene.state.positions_m[i].norm() *
              scene.state.velocities_m_per_s[i].norm();
    }
    EXPECT_LE((after - before).norm(), (2 + 4 * 4) * 300 * round_off() * size);
  }
}

// Directions at the end of the substep lose angular momentum, and not because of the errors that
// the sweeps leave.
TEST_P(DirectionTest, EndDirectionsLoseAngularMomentum) {
  Scene scene = Grid(6, 5, 0.5, 0.4);
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    scene.state.velocities_m_per_s[i] = Vector3d(0, 4, 0).cross(scene.state.positions_m[i]);
  }
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings = OneStep(Direction::kAtEnd, 0.5, 100, 20);
  const ParticleState after = StateAfter(scene);
  double before_spin = 0, after_spin = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const double mass = scene.model->masses_kg()[i];
    before_spin += mass * scene.state.positions_m[i].cross(scene.state.velocities_m_per_s[i]).y();
    after_spin += mass * after.positions_m[i].cross(after.velocities_m_per_s[i]).y();
  }
  EXPECT_LT(after_spin, 0.99 * before_spin);
}

// A pendulum at rest: the stored velocity holds half a substep of gravity along the link, which
// nothing but the velocity stage takes. One sweep over one link is exact.
TEST_P(DirectionTest, TheVelocityStageLeavesNoVelocityAlongALink) {
  constexpr uint32_t kSubsteps = 10;
  constexpr double kTimeStep_s = 0.01;
  Scene scene = Chain(1, 1, 0.5);
  scene.state.positions_m[1] = {0, -1, 0};
  scene.parameters.settings = OneStep(Direction::kBlended, kTimeStep_s, kSubsteps, 3);
  const double half_kick = 9.81 * kTimeStep_s / kSubsteps / 2;
  // g h/2 to the rounding of position / h, once per substep.
  const double rounding = 4 * round_off() * kSubsteps / kTimeStep_s;
  EXPECT_NEAR(StateAfter(scene).velocities_m_per_s[1].y(), -half_kick, rounding);
  scene.parameters.settings.velocity_iterations = 1;
  EXPECT_NEAR(StateAfter(scene).velocities_m_per_s[1].y(), 0, round_off() * half_kick);
}

// RATTLE: with start directions and the velocity stage a pendulum keeps its energy for good. The
// remaining error oscillates with the square of the step and does not grow: over ten times the time
// the largest error is the same, within a tenth of it and rounding.
TEST_P(DirectionTest, StartDirectionsAndTheVelocityStageKeepThePendulumsEnergy) {
  const auto largest_error = [&](uint32_t steps, uint32_t substeps) {
    Scene scene = SceneOf(StraightChain(1, 1, 0.5, 2));
    scene.parameters.settings = OneStep(Direction::kAtStart, 0.05, substeps, 3);
    scene.parameters.settings.velocity_iterations = 1;
    const ClothHandle cloth = Make(scene);
    const double start = -9.81 * std::cos(2.0);
    double largest = 0;
    for (uint32_t k = 0; k < steps; ++k) {
      StepAlone(backend(), cloth, scene);
      const ParticleState state = ReadState(backend(), cloth);
      const double energy =
          state.velocities_m_per_s[1].squaredNorm() / 2 + 9.81 * state.positions_m[1].y();
      largest = std::max(largest, std::abs(energy - start));
    }
    return largest;
  };
  // Each substep rounds v (up to 8 m/s) four times and p twice.
  const auto rounding = [&](uint32_t count) { return round_off() * count * (4 * 64 + 2 * 9.81); };
  const double of_2_s = largest_error(40, 50);
  EXPECT_LE(largest_error(400, 50), 1.1 * of_2_s + rounding(400 * 50));
  EXPECT_LE(largest_error(40, 100), of_2_s / std::exp2(1.8) + rounding(40 * 100));
  EXPECT_LE(largest_error(40, 200), of_2_s / std::exp2(3.6) + rounding(40 * 200));
}

// BLENDED is a rule of the cloth's weight and the substep alone.
TEST_P(DirectionTest, BlendedIsOneOfTheOthersWhereTheSubstepIsShortOrLong) {
  Scene scene = Chain(8, 0.1, 0.01);
  const auto bits = [&](Direction direction, double h) {
    scene.parameters.settings = OneStep(direction, 4 * h, 4, 2);
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 3);
    return ReadBits(backend(), cloth);
  };
  scene.parameters.settings = OneStep(Direction::kBlended, 1, 1, 1);
  const double unit_h = 1 / std::sqrt(WeightGamma(*scene.model, scene.parameters));
  const double short_h = unit_h * std::sqrt(0.9 * kBlendBegin);
  const double long_h = unit_h * std::sqrt(1.1 * kBlendEnd);
  EXPECT_EQ(bits(Direction::kBlended, short_h), bits(Direction::kAtStart, short_h));
  EXPECT_EQ(bits(Direction::kBlended, long_h), bits(Direction::kAtEnd, long_h));
  EXPECT_NE(bits(Direction::kAtStart, short_h), bits(Direction::kAtEnd, short_h));

  // Links that form cells, few pins: the weight that each of them bears.
  scene = Grid(8, 8, 1, 1, {0, 7});
  scene.parameters.settings = OneStep(Direction::kBlended, 1, 1, 1);
  const double pin_h = 1 / std::sqrt(LoadRatio(*scene.model, scene.parameters));
  const double begin_h = pin_h * std::sqrt(0.9 * kWhipBegin);
  const double end_h = pin_h * std::sqrt(1.1 * kWhipEnd);
  EXPECT_EQ(bits(Direction::kBlended, begin_h), bits(Direction::kAtStart, begin_h));
  EXPECT_EQ(bits(Direction::kBlended, end_h), bits(Direction::kAtEnd, end_h));
  EXPECT_NE(bits(Direction::kAtStart, end_h), bits(Direction::kAtEnd, end_h));
}

// A sheet whose hem whips, above a floor that it never touches: with one step along start
// directions alone it blows up within half a second.
TEST_P(DirectionTest, AWhippingHemBesideAFarColliderHolds) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    Scene scene = Grid(32, 32, 1, 1, {0, 31});
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.integration = integration;
    scene.parameters.gravity_m_per_s2 = {-0.609, -9.788, 0.252};
    scene.parameters.colliders = {PlaneThrough({0, -3, 0}, {0, 1, 0})};
    const ClothHandle cloth = Make(scene);
    for (int step = 0; step < 60; ++step) {
      const StepReport report = StepAlone(backend(), cloth, scene, 1, /*measure=*/true);
      ASSERT_EQ(report.fault, FaultReason::kNone) << "step " << step;
      // Survival as the stability atlas defines it.
      ASSERT_LE(report.measured.max_strain, 0.1) << "step " << step;
    }
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(DirectionTest);

// The behaviour of 64 cloths within 4 s, their gravities spread over a cone of 10 degrees, above a
// floor that they never touch.
struct TiltedPlay {
  int faults = 0;
  double max_strain = 0;  // of those without a fault
};

TiltedPlay PlayTilted(uint32_t side, const std::vector<uint32_t>& pins, Direction direction) {
  constexpr uint32_t kCloths = 64;
  Backend& backend = SharedBackend("cpu");
  Scene scene = Grid(side, side, 1, 1, pins);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.integration = Integration::kOneStep;  // the only one with directions
  scene.parameters.settings.direction = direction;
  scene.parameters.colliders = {PlaneThrough({0, -3, 0}, {0, 1, 0})};
  std::vector<StepItem> items;
  for (uint32_t k = 0; k < kCloths; ++k) {
    const double turn = k * M_PI * (std::sqrt(5.0) - 1);  // golden angle: an even spread
    const double tilt = M_PI / 18 * std::sqrt((k + 0.5) / kCloths);
    scene.parameters.gravity_m_per_s2 =
        9.81 *
        Vector3d(std::sin(tilt) * std::cos(turn), -std::cos(tilt), std::sin(tilt) * std::sin(turn));
    items.push_back({CreateCloth(backend, scene), {}, true});
  }
  TiltedPlay play;
  for (int step = 0; step < 240; ++step) {
    play.faults = 0;
    for (const StepReport& report : backend.Step(items).reports) {
      const bool is_faulted = report.fault != FaultReason::kNone;
      play.faults += is_faulted;
      if (!is_faulted) play.max_strain = std::max(play.max_strain, report.measured.max_strain);
    }
  }
  for (const StepItem& item : items) backend.Destroy(item.cloth);
  return play;
}

// The figures beside kWhipBegin are those that this prints.
TEST(DirectionLong, TiltedSheetsAboveAFloorHold) {
  const std::vector<std::pair<uint32_t, std::vector<uint32_t>>> sheets = {
      {16, {0}}, {24, {0, 23}}, {32, {0, 31}}};
  for (const auto& [side, pins] : sheets) {
    for (const Direction direction :
         {Direction::kAtStart, Direction::kAtEnd, Direction::kBlended}) {
      const TiltedPlay play = PlayTilted(side, pins, direction);
      std::printf("%u x %u, %zu pins, direction %d: %d of 64 fault, max strain %.1f %%\n", side,
                  side, pins.size(), static_cast<int>(direction), play.faults,
                  100 * play.max_strain);
      if (direction == Direction::kAtStart) continue;
      EXPECT_EQ(play.faults, 0);
      EXPECT_LE(play.max_strain, 0.1) << "what the stability atlas calls survival";
    }
  }
}

}  // namespace
}  // namespace drape::test
