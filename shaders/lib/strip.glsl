// Stage `solve_strips`: the numbers of one link of a tridiagonal system (server/solver/README.md).
#ifndef DRAPE_LIB_STRIP_GLSL_
#define DRAPE_LIB_STRIP_GLSL_

#include "lib/distance.glsl"

// A link and what the elimination has made of it.
struct StripLink {
  vec3 direction;       // n, unit, at the predicted positions
  float inverse_pivot;  // [kg]
  float right_side;     // over the pivot [N s]: the impulse but for the links behind
};

// How much the impulse of a link changes the error of the next: -w n . n_next [1/kg]; w [1/kg] of the
// particle between them.
float StripCoupling(vec3 direction, vec3 next_direction, float inverse_mass) {
  precise float coupling = -inverse_mass * Dot(direction, next_direction);
  return coupling;
}

// Eliminates the link before from this one. `diagonal` = w_from + w_to + alpha/h^2 [1/kg].
StripLink EliminateLink(DistanceError error, float diagonal, float inverse_h, float coupling,
                        StripLink before) {
  precise float pivot = diagonal - coupling * (coupling * before.inverse_pivot);
  precise float right_side = -error.residual * inverse_h - coupling * before.right_side;
  precise float inverse_pivot = 1.0 / max(pivot, MIN_STRIP_PIVOT * diagonal);
  precise float impulse = right_side * inverse_pivot;
  return StripLink(error.direction, inverse_pivot, impulse);
}

#endif
