// Ropes of bodies: what they carry, how they get taut, pulleys
// (server/solver/bodies/body_joints.h).
#include <algorithm>
#include <cmath>

#include "tests/physics/body_joints.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class BodyRope : public BodyTest {};
INSTANTIATE_TEST_SUITE_P(Backends, BodyRope, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Two balls over two pulleys: the heavier one falls with (M - m)/(M + m) g. A constant acceleration
// is exact in the scheme.
TEST_P(BodyRope, AtwoodsMachineIsExact) {
  for (const double heavy_kg : {1.01, 1.5, 30.0}) {
    Scene scene = Nothing();
    AddBody(scene, Ball({0, 0, 0}, 0.05, heavy_kg));
    AddBody(scene, Ball({0.4, -2, 0}, 0.05, 1));
    HangOnRope(scene, 0, {0, 0.05, 0}, {0.4, -1.95, 0}, 0.45 + 0.4 + 2.45, 1,
               {{0, 0.5, 0}, {0.4, 0.5, 0}});
    const ClothHandle cloth = Make(scene);
    const double acceleration = (heavy_kg - 1) / (heavy_kg + 1) * kG;
    const int steps = heavy_kg > 2 ? 30 : 60;
    for (int step = 1; step <= steps; ++step) {
      Step(cloth, scene);
      const double time_s = step / 60.0, fallen_m = acceleration * time_s * time_s / 2;
      ASSERT_NEAR(report_.bodies->at(0).motion.position_m.y(), -fallen_m, 1e-12);
      ASSERT_NEAR(report_.bodies->at(1).motion.position_m.y(), -2 + fallen_m, 1e-12);
      ASSERT_NEAR(report_.bodies->at(0).motion.velocity_m_per_s.y(), -acceleration * time_s, 1e-11);
    }
  }
}

// A ball on a rope that is taut all the time swings as one on a link.
TEST_P(BodyRope, ATautRopeIsAJointOfTheAnchor) {
  Scene roped = Nothing(), joined = Nothing();
  const Vector3d ball_m(0.5, -0.3, 0.2);
  for (Scene* const scene : {&roped, &joined}) AddBody(*scene, Ball(ball_m, 0.1, 2));
  HangOnRope(roped, 0, ball_m, Vector3d::Zero(), ball_m.norm());
  Collider link = CapsuleBetween(Vector3d::Zero(), ball_m, 1e-3);
  link.mass_kg = 2e-6;
  AddBody(joined, link);
  Join(joined, 0, ball_m, 1);
  Join(joined, 1, Vector3d::Zero());
  const ClothHandle on_rope = Make(roped), on_joint = Make(joined);
  for (int step = 0; step < 120; ++step) {
    const Vector3d of_rope = Step(on_rope, roped).position_m;
    ASSERT_LE(OpenOf(roped, report_), 1e-13);
    const Vector3d of_joint = Step(on_joint, joined).position_m;
    // The link has a millionth of the mass, which changes a speed of up to 3.2 m/s by as much.
    ASSERT_LE((of_rope - of_joint).norm(), 1e-6 * 3.2 * 2) << step;
  }
}

// A ball falls beside its anchor until its rope is taut: what is along the rope is lost then,
// within a substep, and the rest is kept.
TEST_P(BodyRope, ARopeThatGetsTautTakesWhatIsAlongIt) {
  Scene scene = Nothing();
  constexpr double kBeside = 0.6, kLength = 1.0, kMass = 0.7;
  AddBody(scene, Ball({kBeside, 0, 0}, 0.1, kMass));
  HangOnRope(scene, 0, {kBeside, 0, 0}, Vector3d::Zero(), kLength);
  const double fall_m = std::sqrt(kLength * kLength - kBeside * kBeside);
  const double speed = std::sqrt(2 * kG * fall_m);
  // Tangential: the share of the fall across the rope.
  const double kept = speed * kBeside / kLength;
  const double energy = kMass * (kept * kept / 2 - kG * fall_m);
  const ClothHandle cloth = Make(scene);
  const double substep_s = scene.parameters.settings.substep_s();
  for (int step = 1; step <= 120; ++step) {
    const RigidMotion motion = Step(cloth, scene);
    ASSERT_LE(OpenOf(scene, report_), 1e-12);
    const double time_s = step / 60.0;
    const double now = EnergyOfBodies(scene, report_);
    if (time_s < speed / kG) {
      ASSERT_NEAR(now, 0, 1e-12);
      ASSERT_NEAR(motion.position_m.y(), -kG * time_s * time_s / 2, 1e-12);
    } else if (time_s > speed / kG + substep_s) {
      // The hit is late by a substep at most, in which it falls by speed h.
      ASSERT_NEAR(now, energy, 4 * kMass * kG * speed * substep_s) << step;
      ASSERT_LE(now, energy + 4 * kMass * kG * speed * substep_s);
    }
  }
}

// A ball hangs still on its rope over a pulley: the balance on the other side rests on a table that
// feels the difference of the weights.
TEST_P(BodyRope, ARestingRopeCarriesTheWeight) {
  Scene scene = Nothing();
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  AddBody(scene, Ball({0, 0, 0}, 0.05, 1));
  AddBody(scene, BoxAt({0.6, 0.1, 0}, {0.1, 0.1, 0.1}));
  scene.parameters.colliders[1].mass_kg = 3;
  AddBody(scene, BoxAt({0.6, -0.05, 0}, {0.3, 0.05, 0.3}));
  HangOnRope(scene, 0, {0, 0.05, 0}, {0.6, 0.2, 0}, 0.95 + 0.6 + 0.8, 1, {{0, 1, 0}, {0.6, 1, 0}});
  const ClothHandle cloth = Make(scene);
  for (int step = 0; step < 60; ++step) Step(cloth, scene);
  EXPECT_NEAR(-report_.impulses->colliders[2].impulse_n_s.y(), 2 * kG / 60, 1e-9);
  EXPECT_LE(report_.bodies->at(0).motion.position_m.norm(), 1e-9);
  EXPECT_LE(report_.bodies->at(0).motion.velocity_m_per_s.norm(), 1e-9);
}

// What starts open, as after a control that tore it, closes at 1 m/s.
TEST_P(BodyRope, WhatIsTornOpenClosesSlowly) {
  Scene scene = Nothing();
  scene.parameters.gravity_m_per_s2.setZero();
  AddBody(scene, Ball({0, 0, 0}, 0.05, 1));
  AddBody(scene, Ball({1, 0, 0}, 0.05, 1));
  HangOnRope(scene, 0, {0, 0, 0}, {0, 0, 1}, 0.9);
  Join(scene, 1, {1, 0, 0});
  scene.parameters.collider_motions[1].position_m.y() = 0.1;
  const ClothHandle cloth = Make(scene);
  for (int step = 1; step <= 9; ++step) {
    Step(cloth, scene);
    ASSERT_NEAR(report_.bodies->at(1).motion.position_m.y(), std::max(0.1 - step / 60.0, 0.0),
                1e-9);
    ASSERT_NEAR(report_.bodies->at(0).motion.position_m.z(), std::min(step / 60.0, 0.1), 1e-9);
  }
}

}  // namespace
}  // namespace drape::test
