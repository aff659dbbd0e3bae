// The step of one cloth (server/solver/README.md), stage by stage.
#pragma once

#include <span>
#include <vector>

#include "server/solver/cpu/float_controls.h"
#include "server/solver/cpu/float_model.h"
#include "server/solver/step_report.h"
#include "server/solver/substep_schedule.h"

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

// A substep in single precision (solver/substep_schedule.h). While it lasts the positions of the
// working state are b, and the velocities u.
struct FloatSubstep {
  FloatSubstep() = default;
  FloatSubstep(const Substep& substep, double damping_per_s);

  float interval = 0;          // H [s]
  float half_interval = 0;     // H / 2 [s]
  float inverse_interval = 0;  // 1 / H [1/s]
  bool is_two_step = false;
  bool sets_previous = false;
  float pin_shares = 1;
  float pin_velocity_ratio = 1;  // of the velocity of a pin to its u: H / duration
  float kick_before = 0;         // [s]
  float kick_after = 0;
  float kick_within = 0;
  float twist_share = 0;
  float damping_factor = 1;  // of velocities: of v after a ballistic substep, of u before two steps
};

// One link of four strips under way.
struct StripLinkSolution {
  LaneVectors n;   // unit, at the predicted positions
  Lanes coupling;  // to the next link [1/kg]
  Lanes inverse_pivot;
  Lanes impulse;  // [N s]; during the elimination its right side
};

// Working memory of one step; kept by a thread between steps only to save allocations.
struct StepScratch {
  FloatState state;                  // the step's working copy; velocities hold u within a substep
  FloatState previous;               // the state before, two steps only
  std::vector<Lanes> predicted;      // positions for kicks within a substep
  std::vector<Lanes> accelerations;  // [particle_count] springs (+ gravity if IN_FORCE)
  std::vector<Lanes> air_impulses;   // [triangle group][lane] a third of the impulse [N s]
  std::vector<Lanes> distance_impulses;  // Lambda, [group_count + 1] [N s]; only with compliance
  std::vector<StripLinkSolution> strip_links;  // of one group of strips
  std::vector<Lanes> twists;                   // [row of cells, two of them][column]
  std::vector<ContactImpulses> contacts;       // [particle_count][collider_count]
};

// Everything one step needs.
struct StepContext {
  const FloatModel& model;
  const FloatControls& controls;
  std::span<const Lanes> pin_targets;  // [pin_count]
  StepScratch& scratch;
  FloatSubstep substep{};  // the one under way
};

// Steps `state` once. If it blows up, `state` stays as it was and the report says why. The result
// is a function of model, controls, pin targets and state alone. Thread-safe for different states.
StepReport StepCloth(StepContext context, bool measure, FloatState& state);

}  // namespace drape::cpu
