// Scenes of bodies, and the steps of one.
#pragma once

#include <cmath>

#include "tests/physics/physics_test.h"
#include "tests/support/bodies.h"

namespace drape::test {

inline Collider Ball(const Eigen::Vector3d& centre_m, double radius_m, double mass_kg) {
  Collider ball = SphereAt(centre_m, radius_m);
  ball.mass_kg = mass_kg;
  return ball;
}

// Far from everything.
inline Scene Nothing() {
  Scene scene = LoneParticle(Eigen::Vector3d(0, 0, 100), Eigen::Vector3d::Zero());
  scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
  scene.parameters.settings.substeps = 52;
  return scene;
}

inline Eigen::Matrix3d InertiaOf(const Collider& collider, const RigidMotion& motion) {
  const Eigen::Matrix3d turned = motion.rotation.toRotationMatrix();
  return turned * MassOf(collider).inertia * turned.transpose();
}

// Of the bodies of a report, without rebounds or springs [J].
inline double EnergyOfBodies(const Scene& scene, const StepReport& report) {
  double energy = 0;
  for (const BodyState& state : *report.bodies) {
    const Collider& collider = scene.parameters.colliders[state.collider];
    const RigidMotion& motion = state.motion;
    const Eigen::Vector3d& rate = motion.angular_velocity_rad_per_s;
    energy += rate.dot(InertiaOf(collider, motion) * rate) / 2 +
              MassOf(collider).mass_kg * (motion.velocity_m_per_s.squaredNorm() / 2 -
                                          scene.parameters.gravity_m_per_s2.dot(motion.position_m));
  }
  return energy;
}

class BodyTest : public PhysicsTest {
 protected:
  // The state of the first body after a step.
  RigidMotion Step(ClothHandle cloth, const Scene& scene, bool measure = false) {
    const StepItem item{
        .cloth = cloth, .pin_targets_m = scene.pin_targets_m, .measure = measure, .impulses = true};
    report_ = backend().Step({&item, 1}).reports.at(0);
    EXPECT_EQ(report_.fault, FaultReason::kNone);
    return report_.bodies->at(0).motion;
  }
  RigidMotion StepFor(const Scene& scene, double seconds) {
    const ClothHandle cloth = Make(scene);
    RigidMotion motion;
    const double step_s = scene.parameters.settings.time_step_s;
    for (int step = 0; step < std::lround(seconds / step_s); ++step) motion = Step(cloth, scene);
    return motion;
  }

  StepReport report_;  // of the last step
};

}  // namespace drape::test
