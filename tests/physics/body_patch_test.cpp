// Bodies that touch in several points at once: hits, static friction, cylinders
// (server/solver/bodies/contact_problem.h).
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "tests/physics/body_scene.h"

namespace drape::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double kG = 9.81;
const double kSlope = 20 * M_PI / 180;

class BodyPatch : public BodyTest {};
INSTANTIATE_TEST_SUITE_P(Backends, BodyPatch, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// They lie on their lowest points over the xz plane at the origin, turned by `pose`.
enum class Lying { kBox, kPlate, kStandingCylinder, kLyingCylinder, kCoin, kCapsule };
constexpr std::array kAllLying{Lying::kBox,           Lying::kPlate, Lying::kStandingCylinder,
                               Lying::kLyingCylinder, Lying::kCoin,  Lying::kCapsule};

Collider SolidOf(Lying lying) {
  Collider collider;
  switch (lying) {
    case Lying::kBox:
      collider = BoxAt({0, 0.1, 0}, {0.2, 0.1, 0.15});
      break;
    case Lying::kPlate:
      collider = BoxAt({0, 0.02, 0}, {0.3, 0.02, 0.1});
      break;
    case Lying::kStandingCylinder:
      collider.shape = CylinderShape{{0, 0, 0}, {0, 0.15, 0}, 0.12};
      break;
    case Lying::kLyingCylinder:
      collider.shape = CylinderShape{{-0.3, 0.1, 0}, {0.3, 0.1, 0}, 0.1};
      break;
    case Lying::kCoin:
      collider.shape = CylinderShape{{0, 0, 0}, {0, 0.01, 0}, 0.2};
      break;
    case Lying::kCapsule:
      collider.shape = CapsuleShape{{-0.3, 0.1, 0}, {0.3, 0.1, 0}, 0.1};
      break;
  }
  collider.mass_kg = 2;
  return collider;
}

Collider Placed(Collider collider, const Vector3d& position_m, const Quaterniond& rotation) {
  const RigidTransform pose{.position_m = position_m, .rotation = rotation};
  collider.pose.position_m = pose * collider.pose.position_m;
  collider.pose.rotation = rotation * collider.pose.rotation;
  return collider;
}

// What falls flat hits in all its points at once: as a ball it leaves with e times its speed and
// does not turn. The solver's agreement (1e-9 of the speed) is all that is lost.
TEST_P(BodyPatch, AFlatHitLeavesTheSquareOfRestitution) {
  for (const Lying lying : kAllLying) {
    for (const double restitution : {0.9, 0.6, 0.1}) {
      constexpr double kHeight = 0.5;
      Scene scene = Nothing();
      scene.parameters.restitution = restitution;
      AddBody(scene, Placed(SolidOf(lying), {0, kHeight, 0}, Quaterniond::Identity()));
      AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
      const double at_rest_m = scene.parameters.collider_motions[0].position_m.y() - kHeight;
      const ClothHandle cloth = Make(scene);
      double height = kHeight;
      int bounces = 0;
      for (int step = 0; step < 50; ++step) {
        const RigidMotion motion = Step(cloth, scene);
        const double speed = motion.velocity_m_per_s.y();
        const double reached = motion.position_m.y() - at_rest_m + speed * speed / (2 * kG);
        const double next = height * restitution * restitution;
        if (bounces == 0 && reached < (height + next) / 2) {
          height = next;
          ++bounces;
        }
        if (bounces == 1 && reached < height * 0.99) break;  // the second hit
        ASSERT_NEAR(reached, height, 4e-9 * kHeight)
            << static_cast<int>(lying) << ", e = " << restitution << ", step " << step;
        ASSERT_LE(motion.angular_velocity_rad_per_s.norm(), 1e-7);
      }
      EXPECT_EQ(bounces, 1);
    }
  }
}

// Any shape in any pose at any speed, with any e and friction, against a floor and each other: no
// hit adds energy. Flight, and turns about points that stick, keep it to second order in the turn
// of a substep, in each of them (tests/solver/rigid_body_test.cpp).
TEST_P(BodyPatch, NoHitGivesEnergy) {
  std::mt19937 random(20261126);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto direction = [&] {
    std::normal_distribution<double> normal;
    return Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  double most_gain = 0;
  for (int trial = 0; trial < 30; ++trial) {
    Scene scene = Nothing();
    scene.parameters.restitution = uniform(0, 1);
    scene.parameters.friction_static = uniform(0, 1.2);
    scene.parameters.friction_dynamic = uniform(0, 1) * scene.parameters.friction_static;
    const int bodies = 1 + trial % 2;
    for (int b = 0; b < bodies; ++b) {
      Collider body;
      const double size = uniform(0.03, 0.2), length = uniform(0.05, 0.5);
      switch (random() % 3) {
        case 0:
          body = BoxAt({0, 0, 0}, {size, length / 2, uniform(0.03, 0.2)});
          break;
        case 1:
          body.shape = CylinderShape{{0, 0, 0}, {0, length, 0}, size};
          break;
        default:
          body.shape = CapsuleShape{{0, 0, 0}, {0, length, 0}, size};
          break;
      }
      body.mass_kg = std::exp(uniform(-3, 1));
      const Quaterniond turn(AngleAxisd(uniform(0, M_PI), direction()));
      AddBody(scene, Placed(body, {0.1 * b, 0.7 + 0.9 * b, 0}, turn),
              uniform(0, 3) * direction() + Vector3d(0, -2 * b, 0), uniform(0, 15) * direction());
    }
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
    const ClothHandle cloth = Make(scene);
    double energy = 0, scale = 0;
    for (int step = 0; step < 60; ++step) {
      Step(cloth, scene);
      const double now = EnergyOfBodies(scene, report_);
      double fastest = 0;
      for (const BodyState& state : *report_.bodies) {
        fastest = std::max(fastest, state.motion.angular_velocity_rad_per_s.norm());
      }
      if (step == 0) scale = std::max(std::abs(now), 0.1);
      const double turn = fastest * scene.parameters.settings.substep_s();
      const double gain = now - energy;
      if (step > 0) {
        most_gain = std::max(most_gain, gain / scale);
        const double rounding = 1e-12 * scale;
        ASSERT_LE(gain, scale * scene.parameters.settings.substeps * turn * turn + rounding)
            << "trial " << trial << ", step " << step;
      }
      energy = now;
    }
  }
  std::printf("[ MEASURED ] %s: largest gain of a step %.2g of the energy\n",
              backend_name().c_str(), most_gain);
}

struct OnSlope {
  Lying lying;
  double of_tangent = 1;  // static friction, of the slope's tangent
  double of_static = 1;   // dynamic friction, of the static one
  double time_step_s = 1.0 / 60;
  double drop_m = 0;
  Vector3d origin_m = Vector3d::Zero();
};

Vector3d Normal() {
  return {std::sin(kSlope), std::cos(kSlope), 0};
}
Vector3d Down() {
  return {std::cos(kSlope), -std::sin(kSlope), 0};
}

Scene SceneOf(const OnSlope& on) {
  Scene scene = Nothing();
  scene.parameters.settings.time_step_s = on.time_step_s;
  scene.parameters.friction_static = on.of_tangent * std::tan(kSlope);
  scene.parameters.friction_dynamic = on.of_static * scene.parameters.friction_static;
  const Quaterniond turn(AngleAxisd(-kSlope, Vector3d::UnitZ()));
  AddBody(scene, Placed(SolidOf(on.lying), on.origin_m + on.drop_m * Normal(), turn));
  AddBody(scene, PlaneThrough(on.origin_m, Normal()));
  return scene;
}

// What holds: the slip that is allowed to loads over a cylinder, too. Rounding of places and the
// solver's agreement leave a tenth of it 100 m from the origin, nanometres near it.
constexpr double kCreep_m_per_s = 1e-4;

// Static friction 2 % above the tangent of the slope holds what lies on it, whatever the dynamic
// one is. What is dropped by a millimetre goes on down the slope by what it falls beside the
// normal, and then lies still.
class BodyOnSlope : public BodyPatch {
 protected:
  void ExpectHeld(const std::vector<double>& shares_of_static,
                  const std::vector<double>& time_steps_s);
};
INSTANTIATE_TEST_SUITE_P(Backends, BodyOnSlope, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

void BodyOnSlope::ExpectHeld(const std::vector<double>& shares_of_static,
                             const std::vector<double>& time_steps_s) {
  for (const double of_static : shares_of_static) {
    for (const double time_step_s : time_steps_s) {
      for (const Lying lying : kAllLying) {
        for (const double drop_m : {0.0, 1e-3}) {
          OnSlope on{lying, 1.02, of_static, time_step_s, drop_m};
          if (time_step_s == 1.0 / 60) on.origin_m = {60, 20, -80};
          const Scene scene = SceneOf(on);
          const ClothHandle cloth = Make(scene);
          const Vector3d begin = scene.parameters.collider_motions[0].position_m;
          const auto steps = static_cast<int>(std::lround(0.4 / time_step_s));
          Vector3d landed = begin, end;
          for (int step = 0; step < steps; ++step) {
            end = Step(cloth, scene).position_m;
            if (step == steps / 4) landed = end;
          }
          const auto name = [&] {
            return testing::Message() << static_cast<int>(lying) << ", dynamic " << of_static
                                      << ", step " << time_step_s << ", drop " << drop_m;
          };
          const double creep_m = kCreep_m_per_s * steps * time_step_s;
          ASSERT_LE((end - landed).norm(), creep_m) << name();
          ASSERT_LE((end - begin).norm(), drop_m == 0 ? creep_m : 1.2 * drop_m) << name();
        }
      }
    }
  }
}

TEST_P(BodyOnSlope, StaticFrictionHolds) {
  ExpectHeld({1.0}, {1.0 / 30});
  ExpectHeld({0.8}, {1.0 / 240});
  ExpectHeld({0.3}, {1.0 / 60});
}

class BodyOnSlopeLong : public BodyOnSlope {};
INSTANTIATE_TEST_SUITE_P(Backends, BodyOnSlopeLong, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(BodyOnSlopeLong, StaticFrictionHolds) {
  ExpectHeld({1.0, 0.8, 0.3}, {1.0 / 30, 1.0 / 60, 1.0 / 240});
}

// 2 % below it everything slides, and only by the dynamic friction: speed and way are those of the
// constant acceleration.
TEST_P(BodyPatch, SlidesAsTheClosedForm) {
  for (const double of_static : {1.0, 0.7}) {
    for (const Lying lying : kAllLying) {
      const Scene scene = SceneOf({lying, 0.98, of_static});
      const Vector3d begin = scene.parameters.collider_motions[0].position_m;
      const RigidMotion end = StepFor(scene, 1);
      const double friction = scene.parameters.friction_dynamic;
      const double acceleration = kG * (std::sin(kSlope) - friction * std::cos(kSlope));
      EXPECT_NEAR(end.velocity_m_per_s.dot(Down()), acceleration, 1e-6 * acceleration);
      EXPECT_NEAR((end.position_m - begin).dot(Down()), acceleration / 2, 1e-6 * acceleration);
      EXPECT_LE((end.position_m - begin).cross(Down()).norm(), 1e-6 * acceleration);
    }
  }
}

// A cylinder rolls as a round one, at any step: v = 2/3 g sin(a) t.
TEST_P(BodyPatch, ACylinderRollsDownASlope) {
  for (const double time_step_s : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
    Scene scene = Nothing();
    scene.parameters.settings.time_step_s = time_step_s;
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 1;
    constexpr double kRadius = 0.1;
    Collider cylinder;
    cylinder.shape = CylinderShape{kRadius * Normal() - Vector3d(0, 0, 0.2),
                                   kRadius * Normal() + Vector3d(0, 0, 0.2), kRadius};
    cylinder.mass_kg = 1;
    AddBody(scene, cylinder);
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Normal()));
    const RigidMotion end = StepFor(scene, 1);
    const double speed = 2.0 / 3 * kG * std::sin(kSlope);
    EXPECT_NEAR(end.velocity_m_per_s.dot(Down()), speed, 1e-5 * speed);
    EXPECT_NEAR(end.angular_velocity_rad_per_s.z(), -speed / kRadius, 1e-5 * speed / kRadius);
    EXPECT_NEAR(end.position_m.dot(Normal()), kRadius, 1e-6);
  }
}

// Thrown down any way it comes to lie on its side, at the height of its radius, or to stand, and
// then rests: it neither sinks in nor rocks.
TEST_P(BodyPatch, AThrownCylinderComesToRest) {
  Scene scene = Nothing();
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  Collider cylinder;
  cylinder.shape = CylinderShape{{0, 0.3, 0}, {0.1, 0.7, 0.05}, 0.1};
  cylinder.mass_kg = 1;
  AddBody(scene, cylinder, Vector3d::Zero(), {1, 2, 3});
  AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  const RigidMotion end = StepFor(scene, 3);
  EXPECT_NEAR(end.position_m.y(), 0.1, 1e-6);
  const Vector3d axis = end.rotation * Vector3d(0.1, 0.4, 0.05).normalized();
  EXPECT_NEAR(axis.y(), 0, 1e-6);
  // It may roll on, about its axis.
  EXPECT_LE(end.angular_velocity_rad_per_s.cross(axis).norm(), 1e-6);
  EXPECT_LE(std::abs(end.velocity_m_per_s.y()), 1e-6);
}

// Boxes upon larger boxes rest.
TEST_P(BodyPatch, AStackRests) {
  Scene scene = Nothing();
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.3;
  for (int k = 0; k < 4; ++k) {
    Collider box =
        BoxAt({0.01 * (k % 2), 0.05 + 0.1 * k, 0}, {0.2 - 0.03 * k, 0.05, 0.15 - 0.02 * k});
    box.mass_kg = 1 + k % 2;
    AddBody(scene, box);
  }
  AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  StepFor(scene, 0.25);
  for (const BodyState& state : *report_.bodies) {
    const Vector3d begin = scene.parameters.collider_motions[state.collider].position_m;
    EXPECT_LE((state.motion.position_m - begin).norm(), 1e-8) << state.collider;
  }
}

// Two boxes that meet in flight, with friction and a rebound: nothing else acts.
TEST_P(BodyPatch, BoxesThatMeetKeepTheirMomenta) {
  Scene scene = Nothing();
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.friction_static = 0.6;
  scene.parameters.friction_dynamic = 0.3;
  scene.parameters.restitution = 0.5;
  for (int k = 0; k < 2; ++k) {
    Collider box = BoxAt({0.6 * k, 0.05 * k, 0.02}, {0.1, 0.15, 0.08},
                         Quaterniond(AngleAxisd(0.5 + k, Vector3d(1, 1, k).normalized())));
    box.mass_kg = 0.3 + k;
    AddBody(scene, box, {k == 0 ? 2.0 : -1.0, 0.1, 0}, {3, 1 - 2.0 * k, -4});
  }
  const auto momenta = [&](const std::vector<BodyState>& states) {
    std::pair<Vector3d, Vector3d> sums{Vector3d::Zero(), Vector3d::Zero()};
    for (const BodyState& state : states) {
      const Collider& collider = scene.parameters.colliders[state.collider];
      const RigidMotion& motion = state.motion;
      const Vector3d linear = MassOf(collider).mass_kg * motion.velocity_m_per_s;
      sums.first += linear;
      sums.second += motion.position_m.cross(linear) +
                     InertiaOf(collider, motion) * motion.angular_velocity_rad_per_s;
    }
    return sums;
  };
  const ClothHandle cloth = Make(scene);
  Step(cloth, scene);
  const auto [linear, angular] = momenta(*report_.bodies);
  const Vector3d speed = report_.bodies->at(0).motion.velocity_m_per_s;
  for (int step = 0; step < 40; ++step) Step(cloth, scene);
  const auto [linear_after, angular_after] = momenta(*report_.bodies);
  // Some 20 roundings in each of 52 substeps of 40 steps, of speeds of 2 m/s.
  const double rounding = 20 * 52 * 40 * 1.2e-16 * 2;
  EXPECT_LE((linear_after - linear).norm(), rounding);
  EXPECT_LE((angular_after - angular).norm(), rounding);
  EXPECT_GT((report_.bodies->at(0).motion.velocity_m_per_s - speed).norm(), 0.5);  // they have met
}

}  // namespace
}  // namespace drape::test
