// Stage measure: a distance constraint in the committed state.
#ifndef DRAPE_STAGES_COMMITTED_LINK_GLSL_
#define DRAPE_STAGES_COMMITTED_LINK_GLSL_

#include "stages/buffers.glsl"
#include "lib/distance.glsl"
#include "lib/inequality.glsl"

struct CommittedLink {
  uvec2 pair;
  uint kind;
  float elongation;  // [m]
  float violation;   // the part of it that the kind does not allow [m]
  float strain;      // violation / rest length [-]
};

vec3 CommittedPosition(uint i) { return StateVector(cloth.positions + 3u * i); }

uvec2 LoadPair(uint k) {
  if (cloth.is_tiled == 0u) {
    uint pair = models[cloth.model.pairs + k];
    return uvec2(pair & 0xffffu, pair >> 16);
  }
  return uvec2(models[cloth.model.pairs + 2u * k], models[cloth.model.pairs + 2u * k + 1u]);
}

CommittedLink LoadCommittedLink(uint k) {
  uvec2 pair = LoadPair(k);
  float rest_length = cloth.has_own_lengths != 0u ? Parameter(cloth.parameters.length_targets + k)
                                                  : ModelFloat(cloth.model.rest_lengths + k);
  uint kind = cloth.has_inequalities != 0u ? models[cloth.model.kinds + k] : DRAPE_KIND_EQUAL;
  precise vec3 d = CommittedPosition(pair.y) - CommittedPosition(pair.x);
  precise float elongation = Length(d) - rest_length;
  float violation = Violation(kind, elongation);
  precise float strain = violation / rest_length;
  return CommittedLink(pair, kind, elongation, violation, strain);
}

#endif
