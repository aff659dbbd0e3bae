// Particles of the resident plan: one work group holds one cloth in shared memory.
#ifndef DRAPE_STAGES_ACCESS_RESIDENT_GLSL_
#define DRAPE_STAGES_ACCESS_RESIDENT_GLSL_

#include "stages/buffers.glsl"

// With OWNS_PARTICLE an invocation has one particle at most, of which it may keep what no other one reads.

// Each element once: an invocation takes every LOCAL_SIZE-th.
#define FOR_EACH(index, begin, end) \
  for (uint index = (begin) + gl_LocalInvocationID.x; index < (end); index += LOCAL_SIZE)
#ifdef OWNS_PARTICLE
// One round at most, which compilers see.
#define FOR_EACH_PARTICLE(index) \
  for (uint index = gl_LocalInvocationID.x; index < cloth.particle_count; index = 0xffffffffu)
#else
#define FOR_EACH_PARTICLE(index) FOR_EACH(index, 0u, cloth.particle_count)
#endif

// Neighbouring invocations work on neighbours in a row or column of a grid, and hardware serves them at once only
// if their words are in different banks, of which there are 32. A column of 32 x 32 particles would be in one
// bank, so one place in 33 stays empty.
const uint kPlaceCount = CAPACITY + CAPACITY / 32;
uint PlaceOf(uint i) { return i + (i >> 5); }

shared float shared_positions[3u * kPlaceCount];
shared float shared_velocities[3u * kPlaceCount];
shared float shared_inverse_masses[kPlaceCount];
#ifdef HAS_TOLERANCE
// Whether a sweep applied an impulse. Three flags in turn: sweep k writes flag k % 3 and clears the next,
// whose last readers have all passed the barrier that ended sweep k - 1.
shared uint sweep_changed[3];
#endif
shared uint shared_fault;
#ifdef HAS_TWO_FRICTIONS
shared uint shared_holds_until;  // ClothStatus::holds_until
#endif

#ifdef HAS_QUIET_LINKS
// A bit per particle.
shared uint shared_quiet[(CAPACITY + 31) / 32];

void SetQuiet(uint i, bool is_quiet) {
  uint bit = 1u << (i & 31u);
  if (is_quiet) {
    atomicOr(shared_quiet[i >> 5], bit);
  } else {
    atomicAnd(shared_quiet[i >> 5], ~bit);
  }
}
bool IsQuiet(uint i) { return (shared_quiet[i >> 5] >> (i & 31u) & 1u) != 0u; }
#endif

#ifdef HAS_REFINE
// A bit per particle: whether it is an end of a link to refine. Clear outside `refine`.
shared uint shared_flags[(CAPACITY + 31) / 32];
shared uint shared_has_flags;
shared uint shared_refine_solves;  // links solved by `refine` in this step

void FlagParticle(uint i) {
  atomicOr(shared_flags[i >> 5], 1u << (i & 31u));
  shared_has_flags = 1u;  // all writers write the same
}
bool IsFlagged(uint i) { return (shared_flags[i >> 5] >> (i & 31u) & 1u) != 0u; }
#endif

// Index of the one of three flags that the current sweep writes.
uint sweep_flag = 0u;

// The barrier rule of the resident plan: one phase (a set of invocations none of which reads what another
// writes) ends with exactly this call, in uniform control flow.
void PhaseBarrier() {
  memoryBarrierShared();
#ifdef HAS_IMPULSES
  memoryBarrierBuffer();  // a sum may have another writer in the next phase
#endif
  barrier();
}

// Ends a phase whose writes to Scratch (declared coherent then) other invocations read in the next.
void ScratchPhaseBarrier() {
  memoryBarrierBuffer();
  barrier();
}

vec3 Position(uint i) {
  uint word = 3u * PlaceOf(i);
  return vec3(shared_positions[word], shared_positions[word + 1u], shared_positions[word + 2u]);
}
void SetPosition(uint i, vec3 p) {
  uint word = 3u * PlaceOf(i);
  shared_positions[word] = p.x;
  shared_positions[word + 1u] = p.y;
  shared_positions[word + 2u] = p.z;
}

// v between substeps, u within one.
vec3 Velocity(uint i) {
  uint word = 3u * PlaceOf(i);
  return vec3(shared_velocities[word], shared_velocities[word + 1u], shared_velocities[word + 2u]);
}
void SetVelocity(uint i, vec3 v) {
  uint word = 3u * PlaceOf(i);
  shared_velocities[word] = v.x;
  shared_velocities[word + 1u] = v.y;
  shared_velocities[word + 2u] = v.z;
}

float InverseMass(uint i) { return shared_inverse_masses[PlaceOf(i)]; }
void SetInverseMass(uint i, float inverse_mass) { shared_inverse_masses[PlaceOf(i)] = inverse_mass; }

uvec2 UnpackPair(uint pair) { return uvec2(pair & 0xffffu, pair >> 16); }
uvec2 ConstraintPair(uint k) { return UnpackPair(models[cloth.model.pairs + k]); }
// The particles before and after a link, by its place in the lists of links.
uvec2 StripEnds(uint place) { return UnpackPair(models[cloth.model.strip_ends + place]); }

#ifdef HAS_TWO_FRICTIONS
// 1 + the last substep in which some contact holds by friction. All writers write the same value.
void SetHoldsUntil(uint end) { shared_holds_until = end; }
uint HoldsUntil() { return shared_holds_until; }
#endif

// This sweep applied an impulse. All writers write the same value.
void MarkChanged() {
#ifdef HAS_TOLERANCE
  sweep_changed[sweep_flag] = 1u;
#endif
}

#endif
