// Scenes of bodies with joints, and what they keep.
#pragma once

#include <optional>

#include "tests/physics/body_scene.h"

namespace drape::test {

inline void Hinge(Scene& scene, uint32_t c, const Eigen::Vector3d& point_m,
                  const Eigen::Vector3d& axis, std::optional<uint32_t> other = {}) {
  Join(scene, c, point_m - 0.05 * axis, other);
  Join(scene, c, point_m + 0.05 * axis, other);
}

inline void HangOnRope(Scene& scene, uint32_t c, const Eigen::Vector3d& point_m,
                       const Eigen::Vector3d& other_point_m, double length_m,
                       std::optional<uint32_t> other = {},
                       std::vector<Eigen::Vector3d> pulleys_m = {}) {
  BodyJoint rope;
  rope.point_m = point_m;
  rope.other_point_m = other_point_m;
  rope.collider = other;
  rope.rope_length_m = length_m;
  rope.pulleys_m = std::move(pulleys_m);
  scene.parameters.colliders[c].joints.push_back(rope);
}

// As before the first step.
inline StepReport ReportAtStart(const Scene& scene) {
  auto bodies = std::make_shared<std::vector<BodyState>>();
  for (uint32_t c = 0; c < scene.parameters.colliders.size(); ++c) {
    if (!scene.parameters.colliders[c].is_body()) continue;
    bodies->push_back({c, scene.parameters.collider_motions[c]});
  }
  StepReport report;
  report.bodies = bodies;
  return report;
}

inline double EnergyAtStart(const Scene& scene) {
  return EnergyOfBodies(scene, ReportAtStart(scene));
}

inline double KineticOfBodies(const Scene& scene, const StepReport& report) {
  Scene weightless;
  weightless.parameters = scene.parameters;
  weightless.parameters.gravity_m_per_s2.setZero();
  return EnergyOfBodies(weightless, report);
}

struct BodyMomenta {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // about the origin
};

inline BodyMomenta MomentaOfBodies(const Scene& scene, const StepReport& report) {
  BodyMomenta sum;
  for (const BodyState& state : *report.bodies) {
    const Collider& collider = scene.parameters.colliders[state.collider];
    const Eigen::Vector3d momentum = MassOf(collider).mass_kg * state.motion.velocity_m_per_s;
    sum.linear += momentum;
    sum.angular += state.motion.position_m.cross(momentum) +
                   InertiaOf(collider, state.motion) * state.motion.angular_velocity_rad_per_s;
  }
  return sum;
}

// How far apart the ends of the joints are, or ropes too long, between bodies and with the
// environment; the most [m].
inline double OpenOf(const Scene& scene, const StepReport& report) {
  double most = 0;
  const auto place = [&](uint32_t c, const Eigen::Vector3d& described) -> Eigen::Vector3d {
    for (const BodyState& state : *report.bodies) {
      if (state.collider == c) return state.motion.PlaceOf(described);
    }
    return described;
  };
  for (const BodyState& state : *report.bodies) {
    for (const BodyJoint& joint : scene.parameters.colliders[state.collider].joints) {
      const Eigen::Vector3d end = state.motion.PlaceOf(joint.point_m);
      const Eigen::Vector3d other =
          joint.collider ? place(*joint.collider, joint.other_point_m) : joint.other_point_m;
      const double open = joint.is_rope() ? RopeWay_m(joint, end, other) - *joint.rope_length_m
                                          : (end - other).norm();
      most = std::max(most, open);
    }
  }
  return most;
}

}  // namespace drape::test
