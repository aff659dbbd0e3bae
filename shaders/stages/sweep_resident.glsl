// One sweep of the resident plan: strips, refinement, colours, joints, contacts. In uniform control
// flow.
#ifndef DRAPE_STAGES_SWEEP_RESIDENT_GLSL_
#define DRAPE_STAGES_SWEEP_RESIDENT_GLSL_

#include "lib/strip_reduction.glsl"
#include "stages/access_resident.glsl"
#include "stages/solve_contacts.glsl"
#include "stages/solve_distance.glsl"
#include "stages/solve_joints.glsl"
#include "stages/solve_strips.glsl"
// Each file is included once, so files under a condition come last.
#ifdef HAS_REFINE
#include "stages/refine.glsl"
#endif
#ifdef HAS_STRIP_REDUCTION
#include "stages/strip_lanes.glsl"
#ifdef LANE_QUADS
#include "stages/reduce_quads.glsl"
#else
#include "stages/reduce_strips.glsl"
#endif
#include "stages/solve_lanes.glsl"
#endif
#ifdef HAS_STRIP_HALVES
#include "stages/meet_strips.glsl"
#endif

// The strips of a phase: solved by groups of lanes, by two invocations each, or by one.
void SolvePhase(uint phase, bool is_first_sweep) {
#ifdef HAS_STRIP_REDUCTION
  if (FillsSubgroups()) {
    ReduceStrips(phase, is_first_sweep);
    return;
  }
#endif
  uint begin = models[cloth.model.strip_phases + phase];
  uint end = models[cloth.model.strip_phases + phase + 1u];
#ifdef HAS_STRIP_HALVES
  MeetStrips(begin, end, is_first_sweep);
#else
  FOR_EACH(strip, begin, end) SolveStrip(strip, is_first_sweep);
#endif
}

void SolveStrips(bool is_first_sweep) {
#ifdef HAS_SOLVE_STRIPS
  for (uint phase = 0u; phase < cloth.strip_phase_count; ++phase) {
    SolvePhase(phase, is_first_sweep);
    PhaseBarrier();
  }
#endif
}

#ifdef HAS_REFINE
// Whether any link is to be refined.
bool FlagLinks() {
  FOR_EACH(word, 0u, (cloth.particle_count + 31u) / 32u) shared_flags[word] = 0u;
  if (gl_LocalInvocationID.x == 0u) shared_has_flags = 0u;
  PhaseBarrier();
  FOR_EACH(k, 0u, cloth.constraint_count) TestLink(k);
  PhaseBarrier();
  return shared_has_flags != 0u;
}

void RefineFlaggedLinks() {
  for (uint colour = 0u; colour < cloth.colour_count; ++colour) {
    uint begin = models[cloth.model.colour_offsets + colour];
    uint end = models[cloth.model.colour_offsets + colour + 1u];
    FOR_EACH(k, begin, end) {
      if (!IsAtFlag(k)) continue;
      RefineConstraint(k);
      atomicAdd(shared_refine_solves, 1u);
    }
    PhaseBarrier();
  }
}
#endif

void Refine() {
#ifdef HAS_REFINE
  if (gl_LocalInvocationID.x == 0u) shared_refine_solves = 0u;
  for (uint k = 0u; k < cloth.step.refine_rounds; ++k) {
    if (!FlagLinks()) return;
    for (uint sweep = 0u; sweep < REFINE_SWEEPS; ++sweep) RefineFlaggedLinks();
    if (shared_refine_solves >= cloth.step.refine_solves) return;
  }
#endif
}

// solve(k, is_first_sweep) of every constraint k, colour by colour.
#define SOLVE_COLOURS(solve, colour_count, offsets)               \
  for (uint colour = 0u; colour < (colour_count); ++colour) {     \
    uint begin = models[(offsets) + colour];                      \
    uint end = models[(offsets) + colour + 1u];                   \
    FOR_EACH(k, begin, end) solve(k, is_first_sweep);             \
    PhaseBarrier();                                               \
  }

void SolveDistance(bool is_first_sweep) {
#ifdef HAS_SOLVE_DISTANCE
  SOLVE_COLOURS(SolveConstraint, cloth.colour_count, cloth.model.colour_offsets)
#endif
}

void SolveJoints(bool is_first_sweep) {
#ifdef HAS_SOLVE_JOINTS
  SOLVE_COLOURS(SolveJoint, cloth.joint_colour_count, cloth.model.joint_colour_offsets)
#endif
}

void SolveContacts(bool is_first_sweep) {
#ifdef HAS_SOLVE_CONTACTS
  FOR_EACH_PARTICLE(i) SolveContactsOf(i, is_first_sweep);
  PhaseBarrier();
#endif
}

void Sweep(bool is_first_sweep, bool is_last_sweep) {
  SolveStrips(is_first_sweep);
  if (is_last_sweep) Refine();
  SolveDistance(is_first_sweep);
  SolveJoints(is_first_sweep);
  SolveContacts(is_first_sweep);
}

#endif
