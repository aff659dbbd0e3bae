// Bodies and their joints in a scene.
#pragma once

#include <optional>

#include "server/scene/body_mass.h"
#include "tests/support/scenes.h"

namespace drape::test {

// One that starts to move as its collider is described.
inline void AddBody(Scene& scene, const Collider& collider,
                    const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero(),
                    const Eigen::Vector3d& rate = Eigen::Vector3d::Zero()) {
  RigidMotion motion =
      RigidMotion::AtRest(collider.is_body() ? CentreOfMass(collider) : CentreOf(collider));
  motion.velocity_m_per_s = velocity;
  motion.angular_velocity_rad_per_s = rate;
  scene.parameters.colliders.push_back(collider);
  scene.parameters.collider_motions.push_back(motion);
}

// A point joint of collider c with another one, or with the environment.
inline void Join(Scene& scene, uint32_t c, const Eigen::Vector3d& point_m,
                 std::optional<uint32_t> other = {}) {
  BodyJoint joint;
  joint.point_m = joint.other_point_m = point_m;
  joint.collider = other;
  scene.parameters.colliders[c].joints.push_back(joint);
}

}  // namespace drape::test
