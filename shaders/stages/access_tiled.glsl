// Particles of the tiled plan: a cloth is in storage buffers, and each dispatch is one phase for all cloths of the
// batch. Work group y = cloth, invocation x = particle or constraint.
#ifndef DRAPE_STAGES_ACCESS_TILED_GLSL_
#define DRAPE_STAGES_ACCESS_TILED_GLSL_

#include "stages/buffers.glsl"

// The barrier rule of the tiled plan: the host puts a memory barrier between any two dispatches; a
// kernel has none but tiled_refine, tiled_find_range and those of self-contacts.

uint status_index;

// Loads `cloth`.
void OpenCloth(uint item_in_group) {
  BatchItem item = items[first_item + item_in_group];
  OpenRecord(item.cloth);
  status_index = item.status;
}

vec3 Position(uint i) { return ScratchVector(cloth.scratch.work_positions + 3u * i); }
void SetPosition(uint i, vec3 p) { SetScratchVector(cloth.scratch.work_positions + 3u * i, p); }

// v between substeps, u within one.
vec3 Velocity(uint i) { return ScratchVector(cloth.scratch.work_velocities + 3u * i); }
void SetVelocity(uint i, vec3 v) { SetScratchVector(cloth.scratch.work_velocities + 3u * i, v); }

float InverseMass(uint i) { return HeldInverseMass(i); }

#ifdef HAS_QUIET_LINKS
void SetQuiet(uint i, bool is_quiet) { scratch[cloth.scratch.quiet_flags + i] = is_quiet ? 1.0 : 0.0; }
bool IsQuiet(uint i) { return scratch[cloth.scratch.quiet_flags + i] != 0.0; }
#endif

uvec2 ConstraintPair(uint k) {
  uint word = cloth.model.pairs + 2u * k;
  return uvec2(models[word], models[word + 1u]);
}

// The particles before and after a link, by its place in the lists of links.
uvec2 StripEnds(uint place) {
  uint word = cloth.model.strip_ends + 2u * place;
  return uvec2(models[word], models[word + 1u]);
}

#ifdef COUNTS_IN_SCRATCH
// The flags of `refine`, clear outside it.
uint HasFlagsWord() { return cloth.scratch.stretched_flags + cloth.particle_count; }
uint RefinedCountWord(uint colour) { return HasFlagsWord() + 1u + colour; }
// Links solved by earlier rounds of the step.
uint RefineSolvesWord() { return RefinedCountWord(cloth.colour_count); }

// All writers write the same value.
void FlagParticle(uint i) {
  scratch_words[cloth.scratch.stretched_flags + i] = 1u;
  scratch_words[HasFlagsWord()] = 1u;
}
bool IsFlagged(uint i) { return scratch_words[cloth.scratch.stretched_flags + i] != 0u; }
#endif

#ifdef HAS_TWO_FRICTIONS
// 1 + the last substep in which some contact holds by friction. All writers write the same value.
void SetHoldsUntil(uint end) { statuses[status_index].holds_until = end; }
uint HoldsUntil() { return statuses[status_index].holds_until; }
#endif

// This sweep applied an impulse. All writers write the same value.
void MarkChanged() {
#ifdef HAS_TOLERANCE
  statuses[status_index].sweep_changed = 1u;
#endif
}

#endif
