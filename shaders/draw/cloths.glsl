// The storage blocks of the cloths, and access to a particle.
#include "interface/draw_bindings.h"
#include "interface/draw_records.h"

layout(std430, binding = DRAPE_DRAW_BINDING_CLOTHS) readonly buffer Cloths { DrawRecord cloths[]; };
layout(std430, binding = DRAPE_DRAW_BINDING_STATES) readonly buffer States { float states[]; };

layout(location = DRAPE_DRAW_UNIFORM_FIRST_CLOTH) uniform uint first_cloth;

// In the cloth frame [m].
vec3 LocalPosition(uint positions, uint particle) {
  uint word = positions + 3u * particle;
  return vec3(states[word], states[word + 1u], states[word + 2u]);
}

// Tests the bits of the exponent, because compilers may assume that no NaN exists.
bool IsFinite(vec3 p) {
  uvec3 exponent = floatBitsToUint(p) & 0x7f800000u;
  return all(notEqual(exponent, uvec3(0x7f800000u)));
}
