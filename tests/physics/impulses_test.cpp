// What a step gives to pins, grips and colliders (server/solver/method.md, "Impulses"): with the
// weight it is all that changes the momentum of a cloth; at rest, on a slope, on a pendulum it is
// what a scale would show.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/physics/physics_test.h"
#include "tests/support/closed_forms.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/random_cloths.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class Impulses : public PhysicsTest {
 protected:
  StepReport Step(ClothHandle cloth, const Scene& scene) {
    const StepItem item{.cloth = cloth,
                        .pin_targets_m = scene.pin_targets_m,
                        .rest_lengths_m = scene.rest_length_targets_m,
                        .grips = scene.grips,
                        .impulses = true};
    StepReport report = backend().Step({&item, 1}).reports.at(0);
    // The end of the test alone, not of all others.
    if (report.impulses == nullptr) throw std::runtime_error("no impulses of " + scene.name);
    return report;
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, Impulses, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

double MassOf(const SceneModel& model) {
  double mass_kg = 0;
  for (const double m : model.masses_kg()) mass_kg += m;
  return mass_kg;
}

Vector3d MomentumOf(const SceneModel& model, const ParticleState& state) {
  Vector3d momentum = Vector3d::Zero();
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    momentum += model.masses_kg()[i] * state.velocities_m_per_s[i];
  }
  return momentum;
}

// To everything that the cloth touches.
Vector3d SumOf(const StepImpulses& impulses) {
  Vector3d sum = Vector3d::Zero();
  for (const ColliderImpulse& collider : impulses.colliders) sum += collider.impulse_n_s;
  for (const Vector3d& pin : impulses.pins_n_s) sum += pin;
  for (const Vector3d& grip : impulses.grips_n_s) sum += grip;
  return sum;
}

// Every impulse counts, however they cancel [N s].
double SizeOf(const StepImpulses& impulses) {
  double size = 0;
  for (const ColliderImpulse& collider : impulses.colliders) size += collider.impulse_n_s.norm();
  for (const Vector3d& pin : impulses.pins_n_s) size += pin.norm();
  for (const Vector3d& grip : impulses.grips_n_s) size += grip.norm();
  return size;
}

double LargestSpeed(const ParticleState& state) {
  double speed = 0;
  for (const Vector3d& v : state.velocities_m_per_s) speed = std::max(speed, v.norm());
  return speed;
}

// The property that everything else follows from.
class Balance : public Impulses {
 protected:
  // On gl each kind of cloth has kernels of its own, which take seconds to compile: half as many.
  bool HasFewer() const { return backend_name() == "gl"; }

  // weight = change of momentum + impulses given, to rounding, in each of `steps` steps. Roundings:
  // a substep changes a velocity in `changes` places (links and elements of a particle in every
  // sweep, and a dozen stages), each of which rounds a factor, a product, a sum; each rounds at
  // most what velocities and impulses are together. They add up as they come, and a mean of them
  // would be smaller by far.
  void ExpectBalance(const Scene& scene, uint32_t steps, double links_per_particle) {
    SCOPED_TRACE(scene.name);
    const ClothHandle cloth = Make(scene);
    const StepSettings& settings = scene.parameters.settings;
    const double mass_kg = MassOf(*scene.model);
    const double changes = settings.max_iterations * links_per_particle + 12;
    const double fall_m_per_s = scene.parameters.gravity_m_per_s2.norm() * settings.time_step_s;
    ParticleState before = ReadState(backend(), cloth);
    for (uint32_t step = 0; step < steps; ++step) {
      const StepReport report = Step(cloth, scene);
      ASSERT_EQ(report.fault, FaultReason::kNone);
      const ParticleState after = ReadState(backend(), cloth);
      const Vector3d weight = mass_kg * settings.time_step_s * scene.parameters.gravity_m_per_s2;
      const Vector3d left = weight - SumOf(*report.impulses) -
                            (MomentumOf(*scene.model, after) - MomentumOf(*scene.model, before));
      const double scale = mass_kg * (LargestSpeed(before) + LargestSpeed(after) + fall_m_per_s) +
                           SizeOf(*report.impulses);
      const double bound = 4 * round_off() * settings.substeps * changes * scale;
      EXPECT_LE(left.norm(), bound) << "step " << step << ", weight " << weight.norm();
      largest_share_ = std::max(largest_share_, left.norm() / bound);
      before = after;
    }
    std::printf("[ MEASURED ] %s on %s: %.2g of the bound\n", scene.name.c_str(),
                backend_name().c_str(), largest_share_);
    largest_share_ = 0;
  }

  void ExpectBalanceOfAFold(uint32_t steps);

 private:
  double largest_share_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Backends, Balance, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Where the pins go: a little way in every step, the same each time, so that they jerk once.
void MovePins(Scene& scene, const Vector3d& way_m) {
  for (const uint32_t pin : scene.model->pins()) {
    scene.pin_targets_m.push_back(scene.state.positions_m[pin] + way_m);
  }
}

TEST_P(Balance, OfRandomClothsByEveryPreset) {
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime, Preset::kAccurate}) {
    for (size_t kind = 0; kind < kRandomKindNames.size(); ++kind) {
      for (const uint64_t seed : {3u, 11u}) {
        if (HasFewer() && (seed == 3) == (kind % 2 == 0)) continue;
        Scene scene = RandomCloth(static_cast<RandomKind>(kind), seed);
        scene.name += "_" + std::string(PresetName(preset));
        scene.parameters.settings = PresetSettings(preset);
        scene.parameters.settings.max_iterations =
            std::min(scene.parameters.settings.max_iterations, 8u);
        MovePins(scene, {0.002, 0.001, -0.003});
        ExpectBalance(scene, 3, 12);
      }
    }
  }
}

TEST_P(Balance, OfRandomClothsAmongColliders) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    for (size_t kind = 0; kind < kRandomKindNames.size(); ++kind) {
      for (const uint64_t seed : {5u, 17u}) {
        if (HasFewer() && (seed == 5) == (kind % 2 == 0)) continue;
        Scene scene = RandomCloth(static_cast<RandomKind>(kind), seed);
        scene.name += integration == Integration::kOneStep ? "_one" : "_two";
        scene.parameters.settings = PresetSettings(Preset::kRealtime);
        scene.parameters.settings.integration = integration;
        scene.parameters.settings.substeps = 20;
        double lowest_m = 0;
        for (const Vector3d& p : scene.state.positions_m) lowest_m = std::min(lowest_m, p.y());
        scene.parameters.colliders = {PlaneThrough({0, lowest_m - 0.01, 0}, {0, 1, 0}),
                                      SphereAt({0.1, lowest_m - 0.05, 0.1}, 0.12)};
        scene.parameters.friction_static = 0.5;
        scene.parameters.friction_dynamic = 0.4;
        scene.parameters.restitution = seed == 5 ? 0.3 : 0;
        for (Vector3d& v : scene.state.velocities_m_per_s) v.y() -= 1;
        ExpectBalance(scene, 8, 12);
      }
    }
  }
}

TEST_P(Balance, OfSheetsThatLandAndAreHeld) {
  for (Scene scene : {FallingOnSphere(12), FallingOnBoxAndCapsule(12), FallingOnDistanceMap(12)}) {
    for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.5;
    scene.parameters.settings.twist_damping_per_s = 150;
    GripParticles(scene, {0, 77, 143}, {0, -0.02, 0});
    ExpectBalance(scene, 6, 4);
  }
}

TEST_P(Balance, OfASheetOnMovingColliders) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    Scene scene = FallingOnSphere(12);
    scene.parameters.settings.integration = integration;
    Stir(scene, 1);
    scene.parameters.collider_motions = {RigidMotion::AtRest({0.5, -0.35, 0.5}),
                                         RigidMotion::AtRest({0, -0.65, 0})};
    scene.parameters.collider_motions[0].velocity_m_per_s = {0.2, 1.5, 0};
    scene.parameters.collider_motions[0].angular_velocity_rad_per_s = {0, 9, 2};
    ExpectBalance(scene, 10, 4);
  }
}

// Bending and shear by kicks, by lines and by hinges; springs in the force and by kicks.
TEST_P(Balance, OfWhatBendsAndSprings) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    std::vector<Scene> scenes;
    for (const double stiffer : {1.0, 1e4}) {
      scenes.push_back(Grid(12, 9, 0.5, 0.4, {0, 1, 11, 40, 41},
                            {.bending_rigidity_n_m = 1e-4 * stiffer,
                             .shear_modulus_n_per_m = 20 * std::sqrt(stiffer)}));
      scenes.push_back(
          MeshedGrid(9, 9, 1, 1, {0, 1, 40}, {.bending_rigidity_n_m = 5e-5 * stiffer}));
    }
    scenes.push_back(CompliantSheet(12, 1e-4));
    scenes.push_back(CompliantSheet(12, 1e-4));
    scenes.back().parameters.settings.spring_integration = SpringIntegration::kInForce;
    for (Scene& scene : scenes) {
      scene.name += integration == Integration::kOneStep ? "_one" : "_two";
      scene.parameters.settings.integration = integration;
      scene.parameters.settings.substeps = 10;
      Stir(scene, 0.3);
      MovePins(scene, {0.002, 0.001, -0.003});
      ExpectBalance(scene, 3, 24);
      if (HasFewer() && integration == Integration::kOneStep) continue;
      scene.name += "_gripped";
      GripParticles(scene, {29, 30, 66}, {0, 0.004, 0.002});
      ExpectBalance(scene, 3, 24);
    }
  }
}

TEST_P(Balance, OfLinkagesWithJointsRopesAndDrivenLengths) {
  for (const bool has_velocity_sweeps : {false, true}) {
    for (const Sweep sweep : {Sweep::kColours, Sweep::kStrips}) {
      for (Scene scene :
           {JointedChain(6, 0.1, 0), JointedChain(6, 0.1, 1e-3), RopesAndStruts(5, 0.1, 1e-4)}) {
        scene.name += has_velocity_sweeps ? "_velocities" : "";
        scene.parameters.settings.sweep = sweep;
        scene.parameters.settings.max_iterations = 4;
        scene.parameters.settings.velocity_iterations = has_velocity_sweeps ? 3 : 0;
        scene.parameters.settings.integration =
            has_velocity_sweeps ? Integration::kOneStep : Integration::kTwoStep;
        Stir(scene, 0.5);
        MovePins(scene, {0.001, 0.002, 0.003});
        ExpectBalance(scene, 4, 8);
      }
    }
  }
}

// One that gl steps by its tiled plan.
TEST_P(Balance, OfALongChainOfJoints) {
  Scene scene = JointedChain(520, 0.1, 1e-3);
  scene.parameters.settings.max_iterations = 4;
  Stir(scene, 0.5);
  MovePins(scene, {0.001, 0.002, 0.003});
  ExpectBalance(scene, 2, 8);
}

void Balance::ExpectBalanceOfAFold(uint32_t steps) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    // Folded over a row of pins: both halves fall onto each other and onto the pins.
    Scene scene = Grid(10, 17, 0.2, 0.34, {80, 83, 86, 89});
    scene.name = integration == Integration::kOneStep ? "fold_one" : "fold_two";
    scene.parameters.settings.integration = integration;
    scene.parameters.settings.substeps = 20;
    scene.parameters.self_collision =
        SelfCollision{.thickness_m = 0.004, .friction_static = {}, .friction_dynamic = {}};
    scene.parameters.friction_static = 0.3;
    scene.parameters.friction_dynamic = 0.3;
    for (uint32_t i = 0; i < 170; ++i) {
      Vector3d& p = scene.state.positions_m[i];
      const double from_pins = p.z() - 0.17;
      p = {p.x(), from_pins > 0 ? 0.0 : 0.006, 0.17 - std::abs(from_pins)};
      scene.state.velocities_m_per_s[i].y() = from_pins < -0.01 ? -1.5 : 0;
    }
    ExpectBalance(scene, steps, 24);
  }
}

TEST_P(Balance, OfAClothThatTouchesItself) {
  ExpectBalanceOfAFold(backend_name() == "gl" ? 8 : 20);
}

class BalanceLong : public Balance {};
INSTANTIATE_TEST_SUITE_P(Backends, BalanceLong, testing::Values("gl"),
                         [](const auto& one) { return one.param; });

TEST_P(BalanceLong, OfAClothThatTouchesItself) {
  ExpectBalanceOfAFold(20);
}

// The states do not know who asks.
TEST_P(Impulses, ChangeNoBit) {
  Scene scene = FallingOnSphere(12);
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.5;
  const ClothHandle asked = Make(scene), plain = Make(scene);
  for (uint32_t step = 0; step < 12; ++step) {
    EXPECT_EQ(Step(asked, scene).iterations, StepAlone(backend(), plain, scene).iterations);
    ASSERT_TRUE(ReadBits(backend(), asked) == ReadBits(backend(), plain)) << "step " << step;
  }
  const StepItem item{.cloth = plain, .pin_targets_m = {}};
  EXPECT_EQ(backend().Step({&item, 1}).reports.at(0).impulses, nullptr);
}

// A sheet that hangs still weighs m g, damped or not, by one step and by two.
TEST_P(Impulses, OfASheetAtRestAreItsWeight) {
  for (const bool is_damped : {false, true}) {
    // Straight down, where it rests from the start.
    Scene scene = Grid(9, 9, 0.4, 0.4, {0, 4, 8});
    for (Vector3d& p : scene.state.positions_m) p = {p.x(), -p.z(), 0};
    scene.parameters.damping_per_s = 8;
    scene.state = StateAfter(scene, 600);
    scene.parameters.damping_per_s = is_damped ? 8 : 0;
    const ClothHandle cloth = Make(scene);
    const double weight = MassOf(*scene.model) * kG * scene.parameters.settings.time_step_s;
    StepAlone(backend(), cloth, scene);
    const StepReport report = Step(cloth, scene);
    const ParticleState state = ReadState(backend(), cloth);
    // What still moves: its momentum, and what damping takes of it.
    const double moving = MassOf(*scene.model) * LargestSpeed(state) *
                          (2 + scene.parameters.damping_per_s * 1.0 / 60);
    const double bound = moving + 400 * round_off() * weight * 60;
    EXPECT_LE((SumOf(*report.impulses) - Vector3d(0, -weight, 0)).norm(), bound);
    EXPECT_LT(bound, 0.01 * weight);
    for (const Vector3d& pin : report.impulses->pins_n_s) EXPECT_LT(pin.y(), -0.1 * weight);
  }
}

// A bob on a rod, let go level: where it has turned by the angle a from there, v^2 = 2 g l sin a,
// and the pin feels m (g sin a + v^2/l) = 3 m g sin a along the rod, and its own weight.
TEST_P(Impulses, OfAPendulumAreThreeTimesItsWeight) {
  constexpr double kMass_kg = 0.2, kPinMass_kg = 0.05, kRod_m = 0.5;
  Scene scene = Particles({.positions_m = {{0, 0, 0}, {kRod_m, 0, 0}},
                           .masses_kg = {kPinMass_kg, kMass_kg},
                           .distance_constraints = {{0, 1, kRod_m, 0}},
                           .springs = {}},
                          {0});
  scene.parameters.settings.substeps = 200;
  const double dt = scene.parameters.settings.time_step_s;
  const ClothHandle cloth = Make(scene);
  ParticleState before = ReadState(backend(), cloth);
  for (uint32_t step = 0; step < 60; ++step) {
    const StepReport report = Step(cloth, scene);
    const ParticleState after = ReadState(backend(), cloth);
    // Simpson's rule over the step, with its middle on the circle: 3 m g sin(a) varies by
    // (dt g/l)^4 of itself beyond that.
    const Vector3d way = before.positions_m[1] + after.positions_m[1];
    Vector3d impulse = Vector3d::Zero();
    const auto add = [&](const Vector3d& along, double share) {
      const Vector3d n = along.normalized();
      impulse += share * dt * (3 * kMass_kg * kG * -n.y()) * n;
    };
    add(before.positions_m[1], 1.0 / 6);
    add(way, 4.0 / 6);
    add(after.positions_m[1], 1.0 / 6);
    impulse.y() -= kPinMass_kg * kG * dt;
    EXPECT_LE((report.impulses->pins_n_s[0] - impulse).norm(), 0.005 * 3 * kMass_kg * kG * dt)
        << "step " << step;
    before = after;
  }
}

// On a table, a box and a ball: m g dt, and no torque about the middle; about another pivot that of
// the weight at its lever.
TEST_P(Impulses, OfWhatLiesAreItsWeightAndLever) {
  for (const bool is_box : {false, true}) {
    Scene scene = Grid(8, 8, 0.3, 0.3);
    for (Vector3d& p : scene.state.positions_m) p -= Vector3d(0.15, 0, 0.15);
    scene.parameters.colliders = {is_box ? BoxAt({0, -0.1, 0}, {0.4, 0.1, 0.4})
                                         : PlaneThrough({0, 0, 0}, {0, 1, 0})};
    scene.parameters.friction_static = 0.5;
    scene.parameters.friction_dynamic = 0.4;
    const ClothHandle cloth = Make(scene);
    const double weight = MassOf(*scene.model) * kG * scene.parameters.settings.time_step_s;
    StepAlone(backend(), cloth, scene, 60);
    const double bound = 400 * 60 * round_off() * weight;
    const ColliderImpulse felt = Step(cloth, scene).impulses->colliders.at(0);
    EXPECT_LE((felt.impulse_n_s - Vector3d(0, -weight, 0)).norm(), bound);
    EXPECT_LE(felt.angular_impulse_n_m_s.norm(), 0.4 * bound);
    const Vector3d pivot_m(0.2, 0.5, -0.1);
    scene.parameters.collider_motions = {RigidMotion::AtRest(pivot_m)};
    scene.state = ReadState(backend(), cloth);
    const ColliderImpulse at_lever = Step(Make(scene), scene).impulses->colliders.at(0);
    const Vector3d torque = (-pivot_m).cross(Vector3d(0, -weight, 0));
    EXPECT_LE((at_lever.angular_impulse_n_m_s - torque).norm(), bound);
  }
}

// A weight on two ropes of 3 and 4 between pins 5 apart: a right angle, so the ropes carry 4/5 and
// 3/5 of it, along themselves.
TEST_P(Impulses, OfTwoRopesAreTheSharesOfTheWeight) {
  constexpr double kMass_kg = 0.5, kUnit_m = 0.1;
  // The pins at (0, 0) and (5, 0), the weight at (9/5, -12/5).
  Scene scene = Particles(
      {.positions_m = {{0, 0, 0}, {5 * kUnit_m, 0, 0}, {1.8 * kUnit_m, -2.4 * kUnit_m, 0}},
       .masses_kg = {0.1, 0.1, kMass_kg},
       .distance_constraints = {{0, 2, 3 * kUnit_m, 0}, {1, 2, 4 * kUnit_m, 0}},
       .springs = {}},
      {0, 1});
  scene.parameters.damping_per_s = 5;
  scene.parameters.settings.substeps = 4;
  scene.state = StateAfter(scene, 600);
  const ClothHandle cloth = Make(scene);
  const std::vector<Vector3d> felt = Step(cloth, scene).impulses->pins_n_s;
  const double speed = LargestSpeed(scene.state) + LargestSpeed(ReadState(backend(), cloth));
  const double dt = scene.parameters.settings.time_step_s, weight = kMass_kg * kG * dt;
  const Vector3d own(0, -0.1 * kG * dt, 0);
  const Vector3d left(0.6, -0.8, 0), right(-0.8, -0.6, 0);  // along the ropes, away from the pins
  // Each of the four substeps takes out within its interval, 2 h/3 at most, what the places of both
  // ends of a rope, coordinates of 0.5 m, were rounded by. The ropes pull from where the weight
  // would have fallen to within a substep. And it may still move.
  const double h = dt / 4, stretch_m = 4 * round_off() * 0.5;
  const double bound = 4 * kMass_kg * stretch_m / (h / 2) + weight * kG * h * h / (3 * kUnit_m) +
                       2 * kMass_kg * speed;
  EXPECT_LE((felt[0] - own - 0.8 * weight * left).norm(), bound);
  EXPECT_LE((felt[1] - own - 0.6 * weight * right).norm(), bound);
  EXPECT_LT(bound, 0.05 * weight);
}

// Up a slope: m g cos on it, and m g sin along it.
TEST_P(Impulses, OfASheetOnASlopeAreNormalAndFriction) {
  const double angle = 20 * std::numbers::pi / 180;
  Scene scene = Grid(5, 5, 0.12, 0.12);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
  for (Vector3d& p : scene.state.positions_m) p = turn * (p - Vector3d(0.06, 0, 0.06));
  const Vector3d normal = turn * Vector3d::UnitY(), downhill = turn * Vector3d::UnitX();
  scene.parameters.colliders = {PlaneThrough({0, 0, 0}, normal)};
  scene.parameters.friction_static = 0.4;
  scene.parameters.friction_dynamic = 0.3;
  const ClothHandle cloth = Make(scene);
  const double weight = MassOf(*scene.model) * kG * scene.parameters.settings.time_step_s;
  StepAlone(backend(), cloth, scene, 60);
  const Vector3d felt = Step(cloth, scene).impulses->colliders.at(0).impulse_n_s;
  const double bound = 400 * 60 * round_off() * weight;
  EXPECT_NEAR(felt.dot(normal), -weight * std::cos(angle), bound);
  EXPECT_NEAR(felt.dot(downhill), weight * std::sin(angle), bound);
}

}  // namespace
}  // namespace drape::test
