// The substeps of a step for the kernels: the few kinds of solver/substep_schedule.h.
#ifndef DRAPE_SHADERS_INTERFACE_SUBSTEP_RECORD_H_
#define DRAPE_SHADERS_INTERFACE_SUBSTEP_RECORD_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// The first and the last substep; those between come in a cycle, counted from the end
// (kTwistPeriod).
#define DRAPE_SUBSTEP_FIRST 0u
#define DRAPE_SUBSTEP_LAST 1u
#define DRAPE_SUBSTEP_MIDDLE 2u
#define DRAPE_SUBSTEP_CYCLE 4u
#define DRAPE_SUBSTEP_KINDS 6

struct SubstepRecord {
  float interval;          // H [s]
  float inverse_interval;  // 1 / H [1/s]
  float link_interval;     // Substep::link_interval_s [s]
  float inverse_link_interval;
  float inverse_duration;  // [1/s]
  float damping_factor;    // of velocities [-]
  float pin_lead;          // 1 - H / duration: how far on its way the b of a pin is [-]
  uint pin_end;            // pins move 1 / (pin_end - index) of the rest of their way
  float kick_before;       // duration of the kicks [s]; 0: none
  float kick_within;
  float kick_after;
  float twist_share;  // of a cell's twist that each corner loses [-]; 0: no `damp_twist`
  float lead;         // with two steps: b is ahead by lead * v [s]
};

// The record of substep `index` of `count`.
#ifdef __cplusplus
constexpr
#endif
    uint
    SubstepKindOf(uint index, uint count) {
  if (index + 1u == count) return DRAPE_SUBSTEP_LAST;
  if (index == 0u) return DRAPE_SUBSTEP_FIRST;
  return DRAPE_SUBSTEP_MIDDLE + (count - index) % DRAPE_SUBSTEP_CYCLE;
}

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
