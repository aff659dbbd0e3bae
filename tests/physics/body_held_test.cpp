// Bodies against particles that are held: by pins, by grips, at rest or moved by the client
// (server/solver/method.md, "Bodies"). To a body they are infinitely heavy.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "tests/physics/body_scene.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class BodyOnHeld : public BodyTest {
 protected:
  Vector3d OnPins() const {
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& pin : report_.impulses->pins_n_s) sum += pin;
    return sum;
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, BodyOnHeld, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

std::vector<uint32_t> AllOf(uint32_t particle_count) {
  std::vector<uint32_t> all(particle_count);
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

double MassWithPins_kg(const Scene& scene) {
  const auto masses = scene.model->masses_kg();
  return std::accumulate(masses.begin(), masses.end(), 0.0);
}

// Held as a whole, as it lies.
Scene HeldSheet(uint32_t side, double width_m) {
  Scene scene = Grid(side, side, width_m, width_m, AllOf(side * side));
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.thickness_m = 0.002;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  return scene;
}

// A ball falls on the middle of a cell and comes to lie on its four corners, at the height at which
// it touches all of them. They carry it, and themselves. What it moves in its last substep is at
// most g h^2; the force is that of one step, in which it still trembles by that.
TEST_P(BodyOnHeld, ABallComesToLieOnAHeldSheet) {
  for (const double drop_m : {0.0, 0.05}) {
    Scene scene = HeldSheet(9, 0.4);
    constexpr double kRadius = 0.05, kCell = 0.05, kMass = 0.05;
    const double reach = kRadius + scene.parameters.thickness_m;
    const double rest_m = std::sqrt(reach * reach - kCell * kCell / 2);
    AddBody(scene, Ball({0.175, rest_m + drop_m, 0.175}, kRadius, kMass));
    const ClothHandle cloth = Make(scene);
    RigidMotion motion;
    for (int step = 0; step < 60; ++step) motion = Step(cloth, scene);
    const double h = scene.parameters.settings.substep_s();
    EXPECT_NEAR(motion.position_m.y(), rest_m, 2 * kG * h * h) << drop_m;
    const double weight = (kMass + MassWithPins_kg(scene)) * kG;
    EXPECT_NEAR(OnPins().y(), -weight / 60, 0.01 * kMass * kG / 60) << drop_m;
    EXPECT_NEAR(report_.impulses->colliders[0].impulse_n_s.y(), kMass * kG / 60,
                0.01 * kMass * kG / 60);
  }
}

// A rising particle takes a ball that floats above it along with 1 + e times its own speed. That
// speed is a difference of places of up to 0.1 m, rounded, over a substep.
TEST_P(BodyOnHeld, AMovedPinHitsWithItsOwnSpeed) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    Scene scene = HeldSheet(2, 1);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.restitution = restitution;
    constexpr double kSpeed = 0.5;
    AddBody(scene, Ball({0, 0.062, 0}, 0.05, 3));
    scene.pin_targets_m = scene.state.positions_m;
    const ClothHandle cloth = Make(scene);
    RigidMotion motion;
    for (int step = 0; step < 6; ++step) {
      for (Vector3d& target : scene.pin_targets_m) target.y() += kSpeed / 60;
      motion = Step(cloth, scene);
    }
    const double rounding = 8 * round_off() * 0.1 / scene.parameters.settings.substep_s();
    EXPECT_NEAR(motion.velocity_m_per_s.y(), (1 + restitution) * kSpeed, rounding);
    EXPECT_LT(motion.velocity_m_per_s.head<1>().norm(), rounding);
  }
}

// What is gripped stops a ball, and the hand feels all of its momentum.
TEST_P(BodyOnHeld, AGripStopsABall) {
  Scene scene = Grid(2, 2, 1, 1);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.max_grips = 1;
  AddBody(scene, Ball({0, 0.06, 0}, 0.05, 0.3), {0, -1, 0});
  const ClothHandle cloth = Make(scene);
  const Grip grip{.particle = 0, .target_m = scene.state.positions_m[0]};
  const StepItem item{.cloth = cloth, .pin_targets_m = {}, .grips = {&grip, 1}, .impulses = true};
  Vector3d on_hand = Vector3d::Zero();
  for (int step = 0; step < 3; ++step) {
    report_ = backend().Step({&item, 1}).reports.at(0);
    on_hand += report_.impulses->grips_n_s.at(0);
  }
  EXPECT_NEAR(report_.bodies->at(0).motion.velocity_m_per_s.y(), 0, 1e-12);
  EXPECT_NEAR(on_hand.y(), -0.3, 8 * round_off() * 0.3);
}

// Solids of all kinds thrown at a sheet that is held by its rim and its middle, or as a whole: they
// stay above what is held as a whole, gain nothing, and pins, weight and momentum add up.
class ThrownAtHeld : public PhysicsBase,
                     public testing::WithParamInterface<std::tuple<std::string, int>> {
 protected:
  std::string backend_name() const override { return std::get<0>(GetParam()); }
};

TEST_P(ThrownAtHeld, StaysAboveAndGainsNothing) {
  std::mt19937 random(static_cast<uint32_t>(std::get<1>(GetParam())));
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Scene scene = HeldSheet(17, 0.4);
  scene.parameters.thickness_m = std::exp(uniform(std::log(0.002), std::log(0.01)));
  const Preset preset = std::get<1>(GetParam()) % 3 == 0 ? Preset::kAccurate : Preset::kRealtime;
  scene.parameters.settings = PresetSettings(preset);
  scene.parameters.settings.time_step_s = 1 / uniform(30, 240);
  const Vector3d centre(0.2, 0.12, 0.2);
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(uniform(0, 3), Vector3d(uniform(-1, 1), 1, uniform(-1, 1)).normalized()));
  Collider solid;
  switch (std::get<1>(GetParam()) % 4) {
    case 0:
      solid = SphereAt(centre, 0.06);
      break;
    case 1:
      solid = BoxAt(centre, {0.05, 0.04, 0.06}, turn);
      break;
    case 2:
      solid = CapsuleBetween(centre - turn * Vector3d(0.04, 0, 0),
                             centre + turn * Vector3d(0.04, 0, 0), 0.04);
      break;
    default:
      solid = BoxAt(centre, {0.06, 0.03, 0.05});
      break;
  }
  solid.mass_kg = 0.01 * std::pow(1000, std::get<1>(GetParam()) / 7.0);
  AddBody(scene, solid, {uniform(-0.1, 0.1), uniform(-1, 0), uniform(-0.1, 0.1)},
          {uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)});
  const ClothHandle cloth = Make(scene);
  const double mass_kg = MassOf(solid).mass_kg, g = kG;
  const auto energy = [&](const RigidMotion& motion) {
    const Vector3d& rate = motion.angular_velocity_rad_per_s;
    return mass_kg * (motion.velocity_m_per_s.squaredNorm() / 2 + g * motion.position_m.y()) +
           rate.dot(InertiaOf(solid, motion) * rate) / 2;
  };
  RigidMotion before = scene.parameters.collider_motions[0];
  const double scale = energy(before);
  double least = energy(before), gain = 0, lowest = 1;
  const double step_s = scene.parameters.settings.time_step_s;
  for (int step = 0; step < std::lround(1 / step_s); ++step) {
    const StepItem item{.cloth = cloth, .pin_targets_m = {}, .impulses = true};
    const StepReport report = backend().Step({&item, 1}).reports.at(0);
    ASSERT_EQ(report.fault, FaultReason::kNone);
    const RigidMotion motion = report.bodies->at(0).motion;
    gain = std::max(gain, energy(motion) - least);
    least = std::min(least, energy(motion));
    lowest = std::min(lowest, motion.position_m.y());
    Vector3d change = mass_kg * (motion.velocity_m_per_s - before.velocity_m_per_s);
    const double weights = (mass_kg + MassWithPins_kg(scene)) * step_s;
    for (const Vector3d& pin : report.impulses->pins_n_s) change += pin;
    change.y() += weights * kG;
    // Sums of at most 289 pulls in each of the substeps, and the pins' own, of that size.
    const double size = weights * kG + mass_kg * before.velocity_m_per_s.norm();
    ASSERT_LE(change.norm(), 289 * round_off() * 8 * size);
    before = motion;
  }
  std::printf("[ MEASURED ] %s %d: %.3g kg, gain %.2g, lowest %.4f m\n", backend_name().c_str(),
              std::get<1>(GetParam()), mass_kg, gain / scale, lowest);
  EXPECT_LE(gain, 1e-3 * scale);
  if (std::abs(before.position_m.x() - 0.2) < 0.15 &&
      std::abs(before.position_m.z() - 0.2) < 0.15) {
    EXPECT_GT(lowest, 0.02);
  }
}
INSTANTIATE_TEST_SUITE_P(Backends, ThrownAtHeld,
                         testing::Combine(testing::ValuesIn(OwnBackendNames()),
                                          testing::Range(0, 8)));

}  // namespace
}  // namespace drape::test
