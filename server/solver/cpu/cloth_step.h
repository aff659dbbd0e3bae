// The step of one cloth (server/solver/README.md), stage by stage.
#pragma once

#include <span>
#include <vector>

#include "server/solver/cpu/float_controls.h"
#include "server/solver/cpu/float_model.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Positions [m] and velocities [m/s], [particle_count + 1] each; the last one, the spare particle,
// and lane 3 of all stay 0.
struct FloatState {
  std::vector<Lanes> positions;
  std::vector<Lanes> velocities;
};

// What one collider has done to one particle in this substep, times w.
struct ContactImpulses {
  Lanes tangent;
  float normal;
  float floor;  // lowest accepted gap [m]
};

// Working memory of one step; kept by a thread between steps only to save allocations.
struct StepScratch {
  FloatState state;                  // the step's working copy; velocities hold u within a substep
  std::vector<Lanes> accelerations;  // [particle_count] springs (+ gravity if IN_FORCE)
  std::vector<Lanes> air_impulses;   // [triangle group][lane] a third of the impulse [N s]
  // Lambda, [group_count] [N s]; only with compliance or inequalities
  std::vector<Lanes> distance_impulses;
  std::vector<Lanes> joint_impulses;  // Lambda, [joint_count] [N s]
  std::vector<Lanes> rest_lengths;  // [group_count] [m] at the end of the substep; only of its own
  std::vector<ContactImpulses> contacts;  // [particle_count][collider_count]
};

// Rest lengths of one cloth, [group_count] in the places of FloatModel::groups [m].
struct OwnLengths {
  std::vector<Lanes> starts;   // before the step
  std::vector<Lanes> targets;  // at its end
};

// Everything one step needs.
struct StepContext {
  const FloatModel& model;
  const FloatControls& controls;
  std::span<const Lanes> pin_targets;  // [pin_count]
  const OwnLengths* own_lengths;       // null: the rest lengths are the model's
  StepScratch& scratch;
};

// Steps `state` once. If it blows up, `state` stays as it was and the report says why. The result
// is a function of model, controls, pin targets and state alone. Thread-safe for different states.
StepReport StepCloth(const StepContext& context, bool measure, FloatState& state);

}  // namespace drape::cpu
