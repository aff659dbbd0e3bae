// The colliders that the particles of a cloth test in the step under way (server/solver/gl_compute/design.md,
// «Decisions»). A contact with a far collider changes nothing while its particle is in the range; a particle
// outside the range looks at all colliders. Needs the accessors of one plan.
#ifndef DRAPE_STAGES_COLLIDER_REACH_GLSL_
#define DRAPE_STAGES_COLLIDER_REACH_GLSL_

#include "stages/buffers.glsl"

#ifdef HAS_COLLIDER_REACH
#include "lib/float_order.glsl"

// An axis-parallel box of places [m].
struct ParticleRange {
  vec3 low;
  vec3 high;
};

ParticleRange range;       // where free particles are expected to stay during the step
uint far_colliders = 0u;   // a set, as bits: nothing in the range touches them

// `words`: ClothStatus::range.
ParticleRange RangeFrom(uint words[DRAPE_RANGE_WORDS]) {
  float largest[DRAPE_RANGE_WORDS];
  for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) largest[k] = FloatFromOrderedBits(words[k]);
  precise float duration = float(cloth.step.substeps) * cloth.step.h;
  precise float way = (sqrt(largest[6]) + Length(cloth.step.gravity.xyz) * duration) * duration;
  precise float reach = REACH_FACTOR * (way + sqrt(largest[7])) + cloth.step.reach_margin;
  precise vec3 low = -vec3(largest[0], largest[1], largest[2]) - reach;
  precise vec3 high = vec3(largest[3], largest[4], largest[5]) + reach;
  return ParticleRange(low, high);
}

void LoadReach(uint status) {
  range = RangeFrom(statuses[status].range);
  far_colliders = statuses[status].far_colliders;
}

// False for a place that is not a number.
bool IsInRange(vec3 q) {
  return all(greaterThanEqual(q, range.low)) && all(lessThanEqual(q, range.high));
}

// The set of collider c alone; the empty one if it is never left out.
uint SetOf(uint c) { return c < DRAPE_LEFT_OUT_COLLIDERS ? 1u << c : 0u; }

// The first collider of the set from c on, or the first from there on that is never left out.
uint NextIn(uint set, uint c) {
  if (c >= DRAPE_LEFT_OUT_COLLIDERS) return c;
  return c + uint(findLSB(set >> c | 1u << (DRAPE_LEFT_OUT_COLLIDERS - c)));
}

// The set of those that have pushed the particle in this substep: their betas are in Scratch.
uint LoadMetColliders(uint i, bool is_first_sweep) {
  return is_first_sweep ? 0u : uint(scratch[cloth.scratch.met_colliders + i]);
}
void StoreMetColliders(uint i, uint met) { scratch[cloth.scratch.met_colliders + i] = float(met); }
bool HasMet(uint met, uint c, bool is_first_sweep) {
  return c < DRAPE_LEFT_OUT_COLLIDERS ? (met >> c & 1u) != 0u : !is_first_sweep;
}

// The first collider from c on that a particle at q, the end of the substep, is to look at.
uint NextCollider(uint c, uint met, vec3 q) {
  if (far_colliders == 0u) return c;
  return NextIn(IsInRange(q) ? ~far_colliders | met : ~0u, c);
}
// The next of the colliders that it has met, once the sweeps are over.
uint NextMetCollider(uint c, uint met) { return NextIn(met, c); }

#else

uint SetOf(uint c) { return 0u; }
uint LoadMetColliders(uint i, bool is_first_sweep) { return 0u; }
void StoreMetColliders(uint i, uint met) {}
bool HasMet(uint met, uint c, bool is_first_sweep) { return !is_first_sweep; }
uint NextCollider(uint c, uint met, vec3 q) { return c; }
uint NextMetCollider(uint c, uint met) { return c; }

#endif
#endif
