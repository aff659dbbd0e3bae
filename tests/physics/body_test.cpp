// Colliders that carry mass: a cloth and a rigid body that push each other, bodies on floors
// (server/solver/method.md, "Bodies").
#include <algorithm>
#include <cmath>

#include "server/solver/load.h"
#include "tests/physics/body_scene.h"

namespace drape::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double kG = 9.81;

class Body : public BodyTest {};
INSTANTIATE_TEST_SUITE_P(Backends, Body, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// The state of a body is in double precision on every backend; a step passes it on to the bit, so
// steps with the motions of the reports are those of the backend's own.
TEST_P(Body, AStepIsAFunctionOfTheMotionThatItBeginsWith) {
  Scene scene = Nothing();
  Collider brick = BoxAt({0, 5, 0}, {0.1, 0.2, 0.3});
  brick.mass_kg = 2;
  AddBody(scene, brick, {1, 2, 3}, {4, 5, 6});
  AddBody(scene, PlaneThrough({0, 4.5, 0}, Vector3d::UnitY()));
  const ClothHandle own = Make(scene), told = Make(scene);
  std::vector<RigidMotion> motions = scene.parameters.collider_motions;
  for (int step = 0; step < 30; ++step) {
    const RigidMotion its = Step(own, scene);
    const StepItem item{.cloth = told, .pin_targets_m = {}, .collider_motions = motions};
    const StepReport report = backend().Step({&item, 1}).reports.at(0);
    motions[0] = report.bodies->at(0).motion;
    ASSERT_EQ(motions[0].position_m, its.position_m);
    ASSERT_EQ(motions[0].rotation.coeffs(), its.rotation.coeffs());
    ASSERT_EQ(motions[0].velocity_m_per_s, its.velocity_m_per_s);
    ASSERT_EQ(motions[0].angular_velocity_rad_per_s, its.angular_velocity_rad_per_s);
  }
}

struct Momenta {
  Vector3d linear = Vector3d::Zero();
  Vector3d angular = Vector3d::Zero();  // about the origin
  double linear_scale = 0;              // of what adds up
  double angular_scale = 0;
};

Momenta MomentaOf(const Scene& scene, const ParticleState& state, const RigidMotion& motion) {
  Momenta sum;
  const auto add = [&](double mass, const Vector3d& p, const Vector3d& v) {
    sum.linear += mass * v;
    sum.angular += mass * p.cross(v);
    sum.linear_scale += mass * v.norm();
    sum.angular_scale += mass * p.norm() * v.norm();
  };
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    add(scene.model->masses_kg()[i], state.positions_m[i], state.velocities_m_per_s[i]);
  }
  const Collider& body = scene.parameters.colliders[0];
  add(MassOf(body).mass_kg, motion.position_m, motion.velocity_m_per_s);
  const Vector3d spin = InertiaOf(body, motion) * motion.angular_velocity_rad_per_s;
  sum.angular += spin;
  sum.angular_scale += spin.norm();
  return sum;
}

// A free sheet that a brick hits, off its middle, with friction and a rebound: nothing else acts,
// so momentum and angular momentum stay. Links along their start directions keep them to rounding,
// too. In every substep some dozen operations round the velocities and places of the particles,
// which are of the size of the sums' scales.
TEST_P(Body, AHitKeepsMomentumAndAngularMomentum) {
  Scene scene = Grid(16, 16, 1, 1);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings.integration = Integration::kOneStep;
  scene.parameters.settings.direction = Direction::kAtStart;
  scene.parameters.settings.use_tethers = false;
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.4;
  scene.parameters.restitution = 0.3;
  scene.parameters.thickness_m = 0.01;
  Collider brick =
      BoxAt({0.6, 0.3, 0.45}, {0.1, 0.15, 0.08},
            Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector3d(1, 1, 0).normalized())));
  brick.mass_kg = 0.3;
  AddBody(scene, brick, {0.5, -2, 0.3}, {3, 1, -4});
  const ClothHandle cloth = Make(scene);
  const Momenta before =
      MomentaOf(scene, ReadState(backend(), cloth), scene.parameters.collider_motions[0]);
  double given = 0;
  for (int step = 1; step <= 40; ++step) {
    const RigidMotion motion = Step(cloth, scene);
    given += report_.impulses->colliders[0].impulse_n_s.norm();
    const Momenta now = MomentaOf(scene, ReadState(backend(), cloth), motion);
    const double roundings = 12 * 60 * step * round_off();
    ASSERT_LE((now.linear - before.linear).norm(),
              roundings * std::max(now.linear_scale, before.linear_scale));
    ASSERT_LE((now.angular - before.angular).norm(),
              roundings * std::max(now.angular_scale, before.angular_scale));
  }
  EXPECT_GT(given, 0.1);  // it has hit: more than a sixth of its momentum
}

// Weight and impulses are all that changes the momentum of a body, in every step.
TEST_P(Body, ImpulsesAndWeightChangeItsMomentum) {
  Scene scene = Grid(16, 16, 1, 1, {0, 15, 240, 255});
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  AddBody(scene, Ball({0.52, 0.2, 0.47}, 0.12, 0.3), {0.1, 0, 0}, {0, 3, 2});
  const ClothHandle cloth = Make(scene);
  RigidMotion before = scene.parameters.collider_motions[0];
  const double inertia = MassOf(scene.parameters.colliders[0]).inertia(0, 0);
  double most = 0;
  for (int step = 0; step < 90; ++step) {
    const RigidMotion after = Step(cloth, scene);
    const auto& [impulse, moment] = report_.impulses->colliders[0];
    const Vector3d weight = 0.3 / 60 * Vector3d(0, -kG, 0);
    const Vector3d change = 0.3 * (after.velocity_m_per_s - before.velocity_m_per_s);
    // 256 particles, twice in each of the 94 substeps at most: so many sums of doubles.
    const double rounding = 2 * 256 * 94 * 2.3e-16 * (1 + impulse.norm());
    EXPECT_LE((change - weight - impulse).norm(), rounding);
    const Vector3d spin =
        inertia * (after.angular_velocity_rad_per_s - before.angular_velocity_rad_per_s);
    EXPECT_LE((spin - moment).norm(), rounding);
    most = std::max(most, impulse.norm());
    before = after;
  }
  EXPECT_GT(most, 2 * 0.3 * kG / 60);
}

// At rest the cloth carries the ball, and the pins carry both. The damping acts on the cloth alone,
// so the pair swings down with its share of the mass.
TEST_P(Body, AHammockAndItsPinsCarryTheBall) {
  Scene scene = Grid(16, 16, 1, 1, {0, 15, 240, 255});
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.damping_per_s = 6;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  const double cloth_kg = 0.2, ball_kg = 0.2;
  for (const uint32_t pin : scene.model->pins()) {
    Vector3d target = scene.state.positions_m[pin];
    target = Vector3d(0.5, 0, 0.5) + 0.9 * (target - Vector3d(0.5, 0, 0.5));
    scene.pin_targets_m.push_back(target);
  }
  AddBody(scene, Ball({0.5, 0.11, 0.5}, 0.1, ball_kg));
  const ClothHandle cloth = Make(scene);
  RigidMotion before;
  for (int step = 0; step < 600; ++step) before = Step(cloth, scene);
  Vector3d on_ball = Vector3d::Zero(), on_pins = Vector3d::Zero();
  constexpr int kSteps = 60;
  RigidMotion after;
  for (int step = 0; step < kSteps; ++step) {
    after = Step(cloth, scene);
    on_ball += report_.impulses->colliders[0].impulse_n_s;
    for (const Vector3d& pin : report_.impulses->pins_n_s) on_pins += pin;
  }
  const double ball_n = on_ball.y() * 60 / kSteps, pins_n = on_pins.y() * 60 / kSteps;
  std::printf("[ MEASURED ] %s: on the ball %.5f M g, on the pins %.5f (M + m) g, ball at %.4f m\n",
              backend_name().c_str(), ball_n / (ball_kg * kG),
              -pins_n / ((ball_kg + cloth_kg) * kG), after.position_m.y());
  EXPECT_NEAR(ball_n, ball_kg * kG, 0.002 * ball_kg * kG);
  EXPECT_NEAR(-pins_n, (ball_kg + cloth_kg) * kG, 0.002 * (ball_kg + cloth_kg) * kG);
  EXPECT_LT((after.position_m - before.position_m).norm(), 1e-3);
}

// Friction turns sliding into rolling: 5/7 of the speed are left, after 2 v / (7 mu g)
// (a sphere that starts without spin). Rolling starts within a substep of that time, in which
// friction would take mu g h.
TEST_P(Body, ASlidingBallRollsOnWithFiveSevenths) {
  Scene scene = Nothing();
  constexpr double kFriction = 0.2, kSpeed = 2, kRadius = 0.1;
  scene.parameters.friction_static = scene.parameters.friction_dynamic = kFriction;
  AddBody(scene, Ball({0, kRadius, 0}, kRadius, 0.7), {kSpeed, 0, 0});
  AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  const double slides_s = 2 * kSpeed / (7 * kFriction * kG);
  const double substep_s = scene.parameters.settings.substep_s();
  const ClothHandle cloth = Make(scene);
  for (int step = 1; step <= 60; ++step) {
    const RigidMotion motion = Step(cloth, scene);
    const double time_s = step / 60.0;
    const double speed = time_s < slides_s ? kSpeed - kFriction * kG * time_s : 5.0 / 7 * kSpeed;
    ASSERT_NEAR(motion.velocity_m_per_s.x(), speed, kFriction * kG * substep_s) << time_s;
    ASSERT_NEAR(motion.position_m.y(), kRadius, 1e-6);
    if (time_s > slides_s + substep_s) {
      ASSERT_NEAR(motion.velocity_m_per_s.x(), 5.0 / 7 * kSpeed, 1e-4 * kSpeed);
      ASSERT_NEAR(motion.angular_velocity_rad_per_s.z(), -motion.velocity_m_per_s.x() / kRadius,
                  1e-6);
    }
  }
}

// Down a slope: 5/7 g sin a while tan a < 7/2 mu, else g (sin a - mu cos a).
TEST_P(Body, ABallRollsOrSlipsDownASlope) {
  for (const double degrees : {20.0, 45.0}) {
    const double slope = degrees * M_PI / 180;
    constexpr double kFriction = 0.2, kRadius = 0.05;
    Scene scene = Nothing();
    scene.parameters.friction_static = scene.parameters.friction_dynamic = kFriction;
    const Vector3d n(std::sin(slope), std::cos(slope), 0),
        down(std::cos(slope), -std::sin(slope), 0);
    AddBody(scene, Ball(kRadius * n, kRadius, 0.1));
    AddBody(scene, PlaneThrough(Vector3d::Zero(), n));
    const RigidMotion end = StepFor(scene, 0.5);
    const bool rolls = std::tan(slope) < 3.5 * kFriction;
    const double acceleration = rolls ? 5.0 / 7 * kG * std::sin(slope)
                                      : kG * (std::sin(slope) - kFriction * std::cos(slope));
    EXPECT_NEAR(end.velocity_m_per_s.dot(down), 0.5 * acceleration, 2e-3 * acceleration);
    EXPECT_NEAR(end.position_m.dot(down), acceleration / 8, 2e-3 * acceleration / 8);
    EXPECT_NEAR(end.position_m.dot(n), kRadius, 1e-6);
  }
}

// A hit leaves with e times the speed with which it arrives, by energy: e^2 of the height is left.
TEST_P(Body, ABallBouncesToTheSquareOfRestitution) {
  Scene scene = Nothing();
  constexpr double kHeight = 0.5, kRadius = 0.1, kRestitution = 0.8;
  scene.parameters.restitution = kRestitution;
  AddBody(scene, Ball({0, kRadius + kHeight, 0}, kRadius, 3));
  AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  const ClothHandle cloth = Make(scene);
  double height = kHeight;
  int bounces = 0;
  for (int step = 0; step < 120; ++step) {
    const RigidMotion motion = Step(cloth, scene);
    const double speed = motion.velocity_m_per_s.y();
    const double reached = motion.position_m.y() - kRadius + speed * speed / (2 * kG);
    const double next = height * kRestitution * kRestitution;
    if (reached < (height + next) / 2) {
      height = next;
      ++bounces;
    }
    ASSERT_NEAR(reached, height, 1e-9) << step;
  }
  EXPECT_GE(bounces, 2);
}

// A brick that is put down tilted comes to lie, and stays: friction holds it, nothing rocks.
TEST_P(Body, ABrickComesToRestOnTheFloor) {
  Scene scene = Nothing();
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  Collider brick =
      BoxAt({0, 0.2, 0}, {0.1, 0.05, 0.15},
            Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d(1, 0, 0.4).normalized())));
  brick.density_kg_per_m3 = 500;
  AddBody(scene, brick, {0.3, 0, 0});
  AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  const RigidMotion after_2s = StepFor(scene, 2);
  const RigidMotion after_4s = StepFor(scene, 4);
  EXPECT_NEAR(after_4s.position_m.y(), 0.05, 2e-4);
  EXPECT_LT((after_4s.position_m - after_2s.position_m).norm(), 1e-3);
  EXPECT_LT(after_4s.velocity_m_per_s.norm(), 0.01);
  EXPECT_LT(after_4s.angular_velocity_rad_per_s.norm(), 0.05);
}

// Two free balls: momenta stay to rounding, and with e = 1 equal ones exchange their velocities.
TEST_P(Body, EqualBallsExchangeTheirVelocities) {
  Scene scene = Nothing();
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.restitution = 1;
  AddBody(scene, Ball({0, 0, 0}, 0.1, 0.4), {1.5, 0, 0});
  AddBody(scene, Ball({0.5, 0, 0}, 0.1, 0.4));
  const ClothHandle cloth = Make(scene);
  for (int step = 0; step < 40; ++step) {
    Step(cloth, scene);
    const Vector3d sum = report_.bodies->at(0).motion.velocity_m_per_s +
                         report_.bodies->at(1).motion.velocity_m_per_s;
    ASSERT_NEAR(sum.x(), 1.5, 40 * 52 * 2.3e-16 * 1.5);
  }
  EXPECT_NEAR(report_.bodies->at(0).motion.velocity_m_per_s.x(), 0, 1e-9);
  EXPECT_NEAR(report_.bodies->at(1).motion.velocity_m_per_s.x(), 1.5, 1e-9);
}

struct Catch {
  double ratio = 0;  // mass of the ball over that of the cloth
  double most_strain = 0;
  double most_gain = 0;
};

class Caught : public PhysicsBase,
               public testing::WithParamInterface<std::tuple<std::string, Catch>> {
 protected:
  std::string backend_name() const override { return std::get<0>(GetParam()); }
};

double EnergyOf(const Scene& scene, const ParticleState& state, const RigidMotion& motion) {
  double energy = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const double mass = scene.model->masses_kg()[i];
    energy +=
        mass * (state.velocities_m_per_s[i].squaredNorm() / 2 + kG * state.positions_m[i].y());
  }
  const BodyMass mass = MassOf(scene.parameters.colliders[0]);
  const Vector3d& rate = motion.angular_velocity_rad_per_s;
  return energy + rate.dot(InertiaOf(scene.parameters.colliders[0], motion) * rate) / 2 +
         mass.mass_kg * (motion.velocity_m_per_s.squaredNorm() / 2 + kG * motion.position_m.y());
}

// A ball falls 0.3 m, off the middle, into a sheet that hangs by its corners. It is caught: the
// sheet stretches no more than it may, nothing gains energy (as a share of M g times the fall), and
// the ball stays above the sheet.
TEST_P(Caught, StretchesLittleAndGainsNothing) {
  const Catch& bar = std::get<1>(GetParam());
  Scene scene = Grid(32, 32, 1, 1, {0, 31, 31 * 32, 1023});
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  const double ball_kg = bar.ratio * 0.2;
  AddBody(scene, Ball({0.55, 0.1 + 0.3, 0.5}, 0.1, ball_kg));
  for (const uint32_t pin : scene.model->pins()) {
    scene.pin_targets_m.push_back(Vector3d(0.5, 0, 0.5) +
                                  0.9 * (scene.state.positions_m[pin] - Vector3d(0.5, 0, 0.5)));
  }
  // The pins are there before.
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    Vector3d& p = scene.state.positions_m[i];
    p = Vector3d(0.5, 0, 0.5) + 0.9 * (p - Vector3d(0.5, 0, 0.5));
  }
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
  const ClothHandle cloth = Make(scene);
  double most_strain = 0, most_gain = 0, lowest_gap = 1;
  double energy = 0;
  for (int step = 1; step <= 72; ++step) {
    const StepItem item{.cloth = cloth, .pin_targets_m = scene.pin_targets_m, .measure = true};
    const StepReport report = backend().Step({&item, 1}).reports.at(0);
    ASSERT_EQ(report.fault, FaultReason::kNone);
    const RigidMotion motion = report.bodies->at(0).motion;
    const ParticleState state = ReadState(backend(), cloth);
    // The sheet starts compressed and comes to its lengths in the first steps.
    if (step > 6) {
      const double now = EnergyOf(scene, state, motion);
      if (step > 7) most_gain = std::max(most_gain, now - energy);
      energy = step == 7 ? now : std::min(energy, now);
      most_strain = std::max(most_strain, report.measured.max_strain);
    }
    for (const Vector3d& p : state.positions_m) {
      lowest_gap = std::min(lowest_gap, (p - motion.position_m).norm() - 0.1);
    }
  }
  most_gain /= ball_kg * kG * 0.3;
  std::printf(
      "[ MEASURED ] %s, ball : cloth %g: %u substeps, strain %.3f %%, gain %.3g, deepest %.3g m\n",
      backend_name().c_str(), bar.ratio, scene.parameters.settings.substeps, 100 * most_strain,
      most_gain, lowest_gap);
  EXPECT_LE(most_strain, bar.most_strain);
  EXPECT_LE(most_gain, bar.most_gain);
  EXPECT_GT(lowest_gap, -1e-3);
}

// The bars of self-made mass ratios: 15 % and 5 % at 3 : 1, 2 % of energy up to 1 : 1. `reference`,
// which is slow, has the ratios between in the full tier.
const Catch kLight{0.01, 0.02, 0.02}, kHeavy{3, 0.15, 0.05};
const Catch kBetween[] = {{0.1, 0.05, 0.02}, {1, 0.15, 0.02}};

std::string NameOfCatch(const testing::TestParamInfo<std::tuple<std::string, Catch>>& one) {
  const double ratio = std::get<1>(one.param).ratio;
  return std::get<0>(one.param) + "_" + std::to_string(std::lround(1000 * ratio));
}

INSTANTIATE_TEST_SUITE_P(Backends, Caught,
                         testing::Combine(testing::ValuesIn(OwnBackendNames()),
                                          testing::Values(kLight, kHeavy)),
                         NameOfCatch);
INSTANTIATE_TEST_SUITE_P(Between, Caught,
                         testing::Combine(testing::Values("cpu"), testing::ValuesIn(kBetween)),
                         NameOfCatch);
INSTANTIATE_TEST_SUITE_P(BetweenLong, Caught,
                         testing::Combine(testing::Values("reference"),
                                          testing::ValuesIn(kBetween)),
                         NameOfCatch);

}  // namespace
}  // namespace drape::test
