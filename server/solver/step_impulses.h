// What a cloth gives within a step to what holds it and to what it touches.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/solver/substep_schedule.h"

namespace drape {

// To a collider: the sum of the impulses of its contacts.
struct ColliderImpulse {
  Eigen::Vector3d impulse_n_s = Eigen::Vector3d::Zero();
  // About the collider's pivot, where that is when each substep ends; of one without a motion about
  // its centre (CentreOf).
  Eigen::Vector3d angular_impulse_n_m_s = Eigen::Vector3d::Zero();
};

// To a particle: the sum of what its contacts with a collider, or with cloth, gave to it.
struct ParticleImpulse {
  static constexpr uint32_t kCloth = UINT32_MAX;

  uint32_t particle = 0;
  uint32_t collider = 0;  // kCloth: the cloth itself and others of its world
  Eigen::Vector3d impulse_n_s = Eigen::Vector3d::Zero();
};

// Of one step; momentum that the cloth lost and others got. Axes of the cloth's own frame. With the
// weight, the air and the damping they add up to the change of the cloth's momentum, to rounding
// (server/solver/method.md, "Impulses").
struct StepImpulses {
  std::vector<ColliderImpulse> colliders;   // [collider_count]
  std::vector<Eigen::Vector3d> pins_n_s;    // [pin_count]
  std::vector<Eigen::Vector3d> grips_n_s;   // of StepItem::grips, in their order
  std::vector<uint32_t> gripped_particles;  // of each grip
  // Of every particle and collider that touched, by particle, then by collider; last what cloth
  // gave. Of a collider they add up to the opposite of its impulse, but for what bodies and
  // colliders gave to each other. None: not asked for.
  std::optional<std::vector<ParticleImpulse>> contacts;
};

// In the order of StepImpulses::contacts.
void SortContacts(std::vector<ParticleImpulse>& contacts);

// How much of the impulses of a substep reaches the velocities at the end of the step: more than 1
// with two steps, which remember a change of velocity.
struct ImpulseWeights {
  // Of an impulse: what it changes u or v by, times this and the mass, is momentum.
  double impulse = 1;
  // Of a change of the velocity before the substep, in the memory of the following substeps.
  double memory = 0;
};

// Of substep `index` of a step. The impulses of equation (2) act on a velocity that damping has
// already shortened, so they count by 1 + c H more.
ImpulseWeights ImpulseWeightsOf(const SubstepSchedule& schedule, uint32_t index,
                                double damping_per_s);

}  // namespace drape
