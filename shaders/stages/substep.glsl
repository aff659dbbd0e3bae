// The substep under way (solver/substep_schedule.h). Within it, positions are b and velocities u: q = b + H u.
#ifndef DRAPE_STAGES_SUBSTEP_GLSL_
#define DRAPE_STAGES_SUBSTEP_GLSL_

#include "lib/roots.glsl"
#include "stages/buffers.glsl"
#include "stages/impulses.glsl"

#ifdef SHARES_RECORD
uint substep_kind;
#define substep cloth.substeps[substep_kind]
#else
SubstepRecord substep;
#endif
bool is_last_substep;
#ifdef HAS_TWO_FRICTIONS
uint substep_end_index;  // 1 + its index
#endif
uint pin_shares;  // pins move 1 / pin_shares of the rest of their way
// Seconds since the start of the step; only with moving colliders.
float substep_begin;
float substep_end;
// Substep::finds_hinges and hinge_lead_s; only with `solve_hinges`.
bool finds_hinges;
float hinge_lead;

// Needs index < cloth.step.substeps.
void BeginSubstep(uint index) {
  uint kind = SubstepKindOf(index, cloth.step.substeps);
#ifdef SHARES_RECORD
  substep_kind = kind;
#else
  substep = cloths[cloth_slot].substeps[kind];
#endif
  is_last_substep = index + 1u == cloth.step.substeps;
#ifdef HAS_TWO_FRICTIONS
  substep_end_index = index + 1u;
#endif
  pin_shares = substep.pin_end - index;
#ifdef HAS_IMPULSES
  BeginImpulses(index);
#endif
#ifdef HAS_SOLVE_HINGES
  finds_hinges = index % cloth.hinge_period == 0u;
  hinge_lead = 0.5 * float(min(cloth.hinge_period, cloth.step.substeps - index) - 1u) * cloth.step.h;
#endif
#ifdef HAS_MOVING_COLLIDERS
  precise float begin = float(index) * cloth.step.h;
  precise float end = float(index + 1u) * cloth.step.h;
  substep_begin = begin;
  substep_end = end;
#endif
}

// All substeps of a step are of one kind (SubstepSchedule).
bool IsTwoStep() {
#ifdef HAS_TWO_STEPS
  return true;
#else
  return false;
#endif
}

// An impulse Lambda of the substep is the force Lambda * InverseForceTime() [1/s].
float InverseForceTime() {
#ifdef HAS_TWO_STEPS
  if (IsTwoStep()) {
    return Quotient(1.0, substep.kick_within);
  }
#endif
  return substep.inverse_interval;
}

#endif
