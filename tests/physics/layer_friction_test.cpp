// Friction between layers: a sheet on a held one, on a slope (server/solver/method.md,
// solve_self_contacts).
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/physics/physics_test.h"
#include "tests/physics/touching.h"
#include "tests/support/worlds/worlds.h"

namespace drape::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kG = 9.81;

// Any two layers. Both lie in a plane y = const, and gravity is inclined.
struct LayerSlope {
  double angle = 0;      // [rad]
  double direction = 0;  // of the downhill line, about y [rad]
  double turn = 0;       // of the upper layer, about y [rad]
  double drop_m = 0;     // of the upper layer
  double dynamic = 0;    // of the static coefficient
  double thickness_m = 0.004;
  double rigidity_n_m = 0;
  double time_step_s = 1.0 / 60;
  Vector3d place_m = Vector3d::Zero();
  uint32_t lower_side = 16, upper_side = 9;
  bool is_lower_mesh = false, is_upper_mesh = false;

  Vector3d downhill() const { return {std::cos(direction), 0, std::sin(direction)}; }
  Vector3d gravity() const {
    return kG * (std::sin(angle) * downhill() - std::cos(angle) * Vector3d::UnitY());
  }
};

std::vector<LayerSlope> RandomLayers(uint32_t count, uint32_t seed) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<LayerSlope> layers;
  for (uint32_t k = 0; k < count; ++k) {
    layers.push_back({.angle = between(0.1, 0.7),
                      .direction = between(0, 2 * std::numbers::pi),
                      .turn = between(0, 2 * std::numbers::pi),
                      .dynamic = between(0.2, 0.9),
                      .thickness_m = between(0.003, 0.006),
                      .rigidity_n_m = k % 3 == 0 ? 1e-4 : 0,
                      .time_step_s = k % 4 == 3 ? 1.0 / 120 : 1.0 / 60,
                      .place_m = Vector3d(between(-50, 50), between(-50, 50), between(-50, 50)),
                      .lower_side = 10 + static_cast<uint32_t>(between(0, 16)),
                      .upper_side = 6 + static_cast<uint32_t>(between(0, 7)),
                      .is_lower_mesh = k % 2 == 0,
                      .is_upper_mesh = k % 3 != 1});
  }
  return layers;
}

// Around the origin.
Scene Layer(bool is_mesh, uint32_t side, double size_m, double rigidity_n_m, bool is_held) {
  std::vector<uint32_t> pins;
  for (uint32_t i = 0; is_held && i < side * side; ++i) pins.push_back(i);
  const StructuralMaterial material{.bending_rigidity_n_m = rigidity_n_m};
  Scene scene = is_mesh ? MeshedGrid(side, side, size_m, size_m, pins, material)
                        : Grid(side, side, size_m, size_m, pins, material);
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& p : scene.state.positions_m) centre += p;
  centre /= static_cast<double>(side * side);
  for (Vector3d& p : scene.state.positions_m) p -= centre;
  return scene;
}

// gl refuses worlds.
class LayerFriction : public PhysicsTest {
 protected:
  struct Motion {
    double half_way_speed, speed;  // downhill [m/s]
    double late_way_m;             // in the second half
  };

  // Of the upper layer after `duration_s`, where static friction is `friction` of the slope.
  Motion Slide(const LayerSlope& slope, double friction, double duration_s = 0.4) {
    Scene lower = Layer(slope.is_lower_mesh, slope.lower_side, 0.8, slope.rigidity_n_m, true);
    Scene upper = Layer(slope.is_upper_mesh, slope.upper_side, 0.3, slope.rigidity_n_m, false);
    const double height_m = slope.thickness_m + slope.drop_m;
    const auto turn = AngleAxisd(slope.turn, Vector3d::UnitY());
    for (Vector3d& p : upper.state.positions_m) p = turn * p + height_m * Vector3d::UnitY();
    for (Scene* const scene : {&lower, &upper}) {
      for (Vector3d& p : scene->state.positions_m) p += slope.place_m;
      Touch(*scene, friction * std::tan(slope.angle), 52);
      scene->parameters.friction_dynamic = slope.dynamic * scene->parameters.friction_static;
      scene->parameters.thickness_m = slope.thickness_m;
      scene->parameters.gravity_m_per_s2 = slope.gravity();
      scene->parameters.settings.time_step_s = slope.time_step_s;
    }
    ClothWorld world(backend(), 1, {lower, upper});
    const auto half = static_cast<uint32_t>(std::lround(duration_s / 2 / slope.time_step_s));
    world.Step(half);
    const ParticleState middle = world.State(1);
    world.Step(half);
    const ParticleState end = world.State(1);
    const Vector3d downhill = slope.downhill();
    const auto mean = [&](const std::vector<Vector3d>& vectors) {
      double sum = 0;
      for (const Vector3d& v : vectors) sum += downhill.dot(v);
      return sum / static_cast<double>(vectors.size());
    };
    return {mean(middle.velocities_m_per_s), mean(end.velocities_m_per_s),
            mean(end.positions_m) - mean(middle.positions_m)};
  }

  static std::string Name(const LayerSlope& slope) {
    return "angle " + std::to_string(slope.angle) + ", turn " + std::to_string(slope.turn) +
           ", dynamic " + std::to_string(slope.dynamic) + ", sides " +
           std::to_string(slope.lower_side) + " and " + std::to_string(slope.upper_side);
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, LayerFriction, ::testing::Values("reference", "cpu"),
                         [](const auto& case_info) { return std::string(case_info.param); });

// What sticks creeps by what rounding and unequal pressures let it: less than a hundredth of the
// speed that it would have if any part of it slid.
constexpr double kCreep_m_per_s = 1e-3;

TEST_P(LayerFriction, HoldsBelowItsLimitHoweverSmallTheDynamicOneIs) {
  constexpr double kTime_s = 0.4;
  for (const LayerSlope& slope : RandomLayers(6, 5)) {
    SCOPED_TRACE(Name(slope));
    const Motion motion = Slide(slope, 1.02, kTime_s);
    EXPECT_LT(std::abs(motion.late_way_m), kCreep_m_per_s * kTime_s / 2);
  }
}

TEST_P(LayerFriction, HoldsWhatLands) {
  constexpr double kTime_s = 0.4;
  for (LayerSlope slope : RandomLayers(4, 6)) {
    slope.angle = 0.1 + slope.angle * 0.6;  // steeper ones may slide on, see Known and accepted
    slope.drop_m = 0.01 * slope.dynamic;
    SCOPED_TRACE(Name(slope));
    const Motion motion = Slide(slope, 1.02, kTime_s);
    EXPECT_LT(std::abs(motion.late_way_m), kCreep_m_per_s * kTime_s / 2);
  }
}

TEST_P(LayerFriction, SlidesAboveItsLimitByTheDynamicOne) {
  constexpr double kTime_s = 0.4, kShare = 0.97;
  for (const LayerSlope& slope : RandomLayers(6, 7)) {
    SCOPED_TRACE(Name(slope));
    const Motion motion = Slide(slope, kShare, kTime_s);
    const double free = kG * std::sin(slope.angle);
    // Half of what two per cent of a coefficient change.
    EXPECT_NEAR((motion.speed - motion.half_way_speed) / (kTime_s / 2),
                free * (1 - kShare * slope.dynamic), 0.01 * free);
  }
}

TEST_P(LayerFriction, WithoutFrictionNothingHolds) {
  constexpr double kTime_s = 0.4;
  for (LayerSlope slope : RandomLayers(6, 8)) {
    slope.angle /= 2;  // so that the layer stays on the other one
    SCOPED_TRACE(Name(slope));
    const double free = kG * std::sin(slope.angle);
    EXPECT_NEAR(Slide(slope, 0, kTime_s).speed, free * kTime_s, 0.02 * free * kTime_s);
  }
}

}  // namespace
}  // namespace drape::test
