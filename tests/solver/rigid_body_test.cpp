// A rigid body without a cloth against closed forms.
#include "server/solver/bodies/rigid_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace drape {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

Collider Brick(double mass_kg) {
  Collider brick =
      BoxAt({0.3, -0.2, 0.5}, {0.05, 0.1, 0.2},
            Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized())));
  brick.mass_kg = mass_kg;
  return brick;
}

RigidMotion MotionOf(const Collider& collider, const Vector3d& velocity, const Vector3d& rate) {
  RigidMotion motion = RigidMotion::AtRest(CentreOfMass(collider));
  motion.velocity_m_per_s = velocity;
  motion.angular_velocity_rad_per_s = rate;
  return motion;
}

// Steps of `substeps`, each from what a state keeps.
RigidMotion After(const Collider& collider, RigidMotion motion, const Vector3d& gravity,
                  double seconds, int steps, int substeps) {
  const double h = seconds / steps / substeps;
  for (int step = 0; step < steps; ++step) {
    RigidBody body(MassOf(collider), motion);
    for (int substep = 0; substep < substeps; ++substep) {
      body.Begin(h, gravity);
      body.End();
    }
    motion = body.motion();
  }
  return motion;
}

// In the body's own axes.
Vector3d RateInBody(const RigidMotion& motion) {
  return motion.rotation.conjugate() * motion.angular_velocity_rad_per_s;
}

// c + v t + g t^2/2, at any substep: each of them rounds a sum of places and of speeds, of the size
// that these have in the end.
TEST(RigidBody, FallsOnAParabola) {
  const Collider brick = Brick(2.5);
  const Vector3d g(0, -9.81, 0), velocity(1, 4, -2);
  const RigidMotion end = After(brick, MotionOf(brick, velocity, {3, -2, 5}), g, 0.9, 10, 7);
  const Vector3d place = CentreOfMass(brick) + 0.9 * velocity + 0.9 * 0.9 / 2 * g;
  const Vector3d speed = velocity + 0.9 * g;
  const double rounding = 70 * 4 * kEpsilon * (place.norm() + velocity.norm() + speed.norm());
  EXPECT_LE((end.position_m - place).norm(), rounding);
  EXPECT_LE((end.velocity_m_per_s - speed).norm(), rounding);
}

// It goes on from where it was shifted to, with the velocity and the angular momentum that it had.
TEST(RigidBody, IsShiftedWithoutAChangeOfVelocity) {
  const Collider brick = Brick(2.5);
  const Vector3d way(0.01, -0.02, 0.03), turn(0.3, 0.2, -0.1);
  RigidBody body(MassOf(brick), MotionOf(brick, {1, 4, -2}, {3, -2, 5}));
  RigidBody shifted = body;
  for (RigidBody* its : {&body, &shifted}) its->Begin(0.01, {0, -9.81, 0});
  const RigidMotion end = body.AtEnd();
  shifted.Shift(way, turn);
  body.End();
  shifted.End();
  EXPECT_EQ(shifted.motion().velocity_m_per_s, body.motion().velocity_m_per_s);
  EXPECT_EQ(shifted.angular_momentum(), body.angular_momentum());
  EXPECT_EQ(shifted.motion().position_m, end.position_m + way);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  EXPECT_LE(shifted.motion().rotation.angularDistance(turned * end.rotation), 8 * kEpsilon);
  shifted.Begin(0.01, {0, -9.81, 0});
  EXPECT_EQ(shifted.AtEnd().position_m, shifted.motion().After(0.01).position_m) << "once";
}

// Without forces it stays to rounding, however it tumbles: a step keeps it, and its state rounds
// two products of a matrix and a vector each way, of the condition of the inertia.
TEST(RigidBody, KeepsItsAngularMomentum) {
  const Collider brick = Brick(1);
  const BodyMass mass = MassOf(brick);
  const RigidMotion start = MotionOf(brick, Vector3d::Zero(), {4, 7, -5});
  const auto momentum = [&](const RigidMotion& motion) -> Vector3d {
    const Matrix3d turned = motion.rotation.toRotationMatrix();
    return turned * mass.inertia * turned.transpose() * motion.angular_velocity_rad_per_s;
  };
  constexpr int kSteps = 600;
  const RigidMotion end = After(brick, start, Vector3d::Zero(), 10, kSteps, 52);
  const Vector3d change = momentum(end) - momentum(start);
  const double relative = change.norm() / momentum(start).norm();
  const Vector3d extents(0.1 * 0.1 + 0.2 * 0.2, 0.05 * 0.05 + 0.2 * 0.2, 0.05 * 0.05 + 0.1 * 0.1);
  const double condition = extents.maxCoeff() / extents.minCoeff();
  EXPECT_LE(relative, kSteps * 16 * condition * kEpsilon);
  std::printf("[ MEASURED ] change of the angular momentum in 10 s: %.2g\n", relative);
}

// Euler's equations about the middle axis (Landau & Lifshitz, Mechanics, section 37): with M^2 > 2
// E I2 the rates in the body are elliptic functions with the period 4 K(k) over their frequency.
// The brick turns over twice in it.
TEST(RigidBody, TurnsOverInThePeriodOfEulersEquations) {
  Collider brick = BoxAt(Vector3d::Zero(), {0.05, 0.1, 0.2});
  brick.mass_kg = 1;
  const Vector3d inertia = MassOf(brick).inertia.diagonal();  // of x the largest, of z the least
  const double i1 = inertia.z(), i2 = inertia.y(), i3 = inertia.x();
  // At the extreme of the other two rates that of the middle axis is 0. k^2 = 0.97.
  const double w3 = 6;
  const double share = 0.97 * (i3 - i2) * i3 / ((i2 - i1) * i1);
  const double w1 = w3 * std::sqrt(share);
  const double twice_energy = i1 * w1 * w1 + i3 * w3 * w3;
  const double momentum_sq = i1 * i1 * w1 * w1 + i3 * i3 * w3 * w3;
  ASSERT_GT(momentum_sq, twice_energy * i2);
  const double k_sq = (i2 - i1) * (twice_energy * i3 - momentum_sq) /
                      ((i3 - i2) * (momentum_sq - twice_energy * i1));
  EXPECT_NEAR(k_sq, 0.97, 1e-12);
  const double frequency =
      std::sqrt((i3 - i2) * (momentum_sq - twice_energy * i1) / (i1 * i2 * i3));
  const double period = 4 * std::comp_ellint_1(std::sqrt(k_sq)) / frequency;
  const RigidMotion start = MotionOf(brick, Vector3d::Zero(), {w3, 0, w1});
  const auto error = [&](int substeps) -> Vector3d {
    const RigidMotion end = After(brick, start, Vector3d::Zero(), period, 20, substeps);
    return (RateInBody(end) - RateInBody(start)) / RateInBody(start).norm();
  };
  // Half a period later the other way round.
  const RigidMotion half = After(brick, start, Vector3d::Zero(), period / 2, 20, 200);
  EXPECT_NEAR(RateInBody(half).z(), -w1, 1e-3 * w1);
  // Second order: the errors are as 4 to 1, and what they have in common is the whole of them.
  const Vector3d coarse = error(100), fine = error(200);
  EXPECT_NEAR(coarse.norm() / fine.norm(), 4, 0.2);
  EXPECT_LT((4 * fine - coarse).norm() / 3, fine.norm() / 20);
  std::printf(
      "[ MEASURED ] period %.4f s; error of the rates after it: %.3g, half the substep %.3g\n",
      period, coarse.norm(), fine.norm());
}

// Of any shape of inertia and turn, up to half a turn per substep: the angular momentum stays, so
// the energy is between those of the least and of the largest inertia.
TEST(RigidBody, GainsNoEnergyWithoutBoundHoweverFastItTurns) {
  Collider needle = CapsuleBetween({0, 0, 0}, {0, 0.5, 0}, 0.002);
  needle.density_kg_per_m3 = 7800;
  const BodyMass mass = MassOf(needle);
  const double h = 1.0 / 60;
  RigidBody body(mass, MotionOf(needle, Vector3d::Zero(), {3000, 3e5, -2000}));
  const Vector3d momentum = body.angular_momentum();
  const double most = momentum.squaredNorm() * mass.inertia.inverse().norm();
  for (int substep = 0; substep < 500; ++substep) {
    body.Begin(h, Vector3d::Zero());
    body.End();
    ASSERT_EQ(body.angular_momentum(), momentum);
    ASSERT_LE(momentum.dot(body.motion().angular_velocity_rad_per_s), most);
  }
}

}  // namespace
}  // namespace drape
