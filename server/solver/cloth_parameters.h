// The part of a cloth that may change while it runs without a new model.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/solver/solver_constants.h"
#include "server/solver/step_settings.h"

namespace drape {

// How a cloth touches itself. Unset members are those of the material (SelfContactOf).
struct SelfCollision {
  std::optional<double> thickness_m;       // > 0
  std::optional<double> friction_static;   // >= friction_dynamic
  std::optional<double> friction_dynamic;  // >= 0
};

// All in the cloth's own frame.
struct ClothParameters {
  Eigen::Vector3d gravity_m_per_s2{0, -9.81, 0};
  Eigen::Vector3d wind_m_per_s{0, 0, 0};  // velocity of the air; no effect without drag or lift
  double damping_per_s = 0;               // >= 0; v decays as exp(-damping t)
  double friction_static = 0;             // >= friction_dynamic
  double friction_dynamic = 0;            // >= 0
  double restitution = 0;                 // [0, 1]; share of the approach speed that a hit leaves
  double thickness_m = 0;                 // >= 0; gap = distance to the collider - thickness
  double air_drag = 0;                    // drag coefficient, [0, kMaxAirCoefficient]
  double air_lift = 0;                    // lift coefficient, [0, kMaxAirCoefficient]
  std::optional<SelfCollision> self_collision;  // unset: the cloth passes through itself
  bool is_in_world = false;                     // StepItem::world may name one
  std::vector<Collider> colliders;
  // How they move from the next step on, [colliders.size()]; empty: all of them rest as described.
  std::vector<RigidMotion> collider_motions;
  StepSettings settings;
  uint32_t max_grips = 0;  // particles that a step may hold besides the pins, [0, kMaxGrips]
};

// The thickness of a cloth that touches itself, if neither it nor its material says one [m].
inline constexpr double kDefaultSelfThickness_m = 1e-3;

// SelfCollision with all its numbers.
struct SelfContactNumbers {
  double thickness_m = kDefaultSelfThickness_m;
  double friction_static = 0;
  double friction_dynamic = 0;
};

// How the cloth touches itself, if it does, and other cloths of its world.
inline SelfContactNumbers SelfContactOf(const ClothParameters& parameters) {
  const SelfCollision self = parameters.self_collision.value_or(SelfCollision{});
  const double material_m = parameters.thickness_m;
  return {.thickness_m =
              self.thickness_m.value_or(material_m > 0 ? material_m : kDefaultSelfThickness_m),
          .friction_static = self.friction_static.value_or(parameters.friction_static),
          .friction_dynamic = self.friction_dynamic.value_or(parameters.friction_dynamic)};
}

// Whether colliders move, or rest elsewhere than described.
inline bool HasMovingColliders(const ClothParameters& parameters) {
  return !parameters.collider_motions.empty();
}

// Whether what slips has less friction than what sticks.
inline bool HasTwoFrictions(const ClothParameters& parameters) {
  return parameters.friction_static > parameters.friction_dynamic;
}

// Whether particles may bounce off colliders.
inline bool HasRestitution(const ClothParameters& parameters) {
  return !parameters.colliders.empty() && parameters.restitution > 0;
}

// Slowest approach to a collider that is a hit, from which a particle bounces [m/s]: the speed that
// gravity gives in kReboundSubsteps substeps.
inline double SlowestRebound(const ClothParameters& parameters) {
  return kReboundSubsteps * parameters.gravity_m_per_s2.norm() * parameters.settings.substep_s();
}

// With two steps a particle that approaches a collider faster than this lands [m/s].
inline double SlowestLanding(const ClothParameters& parameters) {
  return kLandingSubsteps * parameters.settings.substep_s() * parameters.gravity_m_per_s2.norm();
}
// How fast what rests may be made to slide within a substep by its weight [m/s].
inline double SlowestSlip(const ClothParameters& parameters) {
  return parameters.settings.substep_s() * parameters.gravity_m_per_s2.norm();
}

}  // namespace drape
