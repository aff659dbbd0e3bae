// The substep under way and how long everything acts in it: solver/substep_schedule.h.
#ifndef DRAPE_STAGES_SUBSTEP_GLSL_
#define DRAPE_STAGES_SUBSTEP_GLSL_

#include "stages/buffers.glsl"

// While it lasts the positions of the particles are b, and their velocities u: q = b + H u.
struct Substep {
  float interval;            // H [s]
  float half_interval;       // H / 2 [s]
  float inverse_interval;    // 1 / H [1/s]
  float damping_factor;      // [-]
  float inverse_duration;    // [1/s]
  float pin_lead;            // 1 - H / duration: how far on its way the b of a pin is [-]
  bool is_two_step;
  bool sets_previous;
  bool is_last;
  // From the start of the step; only with moving colliders, which have substeps of one length only.
  float begin;  // [s]
  float end;
  uint pin_shares;  // pins go 1 / pin_shares of the rest of their way
};

Substep substep;

void BeginSubstep(uint index) {
#ifdef HAS_TWO_STEPS
  uint kind = min(index, 2u);
  substep.interval = cloth.intervals[kind];
  substep.half_interval = 0.5 * substep.interval;
  substep.inverse_interval = cloth.inverse_intervals[kind];
  substep.damping_factor = cloth.damping_factors[kind];
  substep.inverse_duration = cloth.inverse_durations[kind];
  substep.pin_lead = index > 0u ? 1.0 / 3.0 : 0.0;
  substep.is_two_step = index > 0u;
  substep.sets_previous = index != 1u;
  // The first two are halves of a substep.
  substep.pin_shares = index < 2u ? 2u * (cloth.substeps - 1u) - index : cloth.substeps - index;
#else
  substep.interval = cloth.h;
  substep.half_interval = cloth.half_h;
  substep.inverse_interval = cloth.inverse_h;
  substep.damping_factor = cloth.damping_factors.x;
  substep.inverse_duration = cloth.inverse_h;
  substep.pin_lead = 0.0;
  substep.is_two_step = false;
  substep.sets_previous = false;
  substep.pin_shares = cloth.substeps - index;
#endif
#ifdef HAS_MOVING_COLLIDERS
  precise float begin = float(index) * cloth.h;
  precise float end = float(index + 1u) * cloth.h;
  substep.begin = begin;
  substep.end = end;
#endif
  substep.is_last = index + 1u == cloth.substeps;
}

// Share of the twist of a cell that `damp_twist` gives back in this substep; 0: not due.
float TwistShare(uint index) {
#ifdef HAS_TWO_STEPS
  if (index == 0u) return 0.0;
#endif
  return (cloth.substeps - 1u - index) % cloth.twist_period == 0u ? cloth.twist_share : 0.0;
}

#endif
