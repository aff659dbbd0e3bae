// Stage `solve_strips`: the numbers of one link of a tridiagonal system (server/solver/method.md).
#ifndef DRAPE_LIB_STRIP_GLSL_
#define DRAPE_LIB_STRIP_GLSL_

#include "lib/distance.glsl"

// A link after elimination.
struct StripLink {
  vec3 direction;       // n, of the impulse
  vec3 n_end;           // unit, at the predicted positions
  float inverse_pivot;  // [kg]
  float right_side;     // over the pivot [N s]: the impulse without the effect of later links
};

// The effect of a link's impulse on the error of its neighbour: -w n . n_end [1/kg], w [1/kg] of the particle
// between them.
float StripCoupling(vec3 direction, vec3 n_end_of_other, float inverse_mass) {
  precise float coupling = -inverse_mass * Dot(direction, n_end_of_other);
  return coupling;
}

// The right side of the row of a link: the change of velocity that removes its residual [m] in a substep [m/s].
float StripRightSide(float residual, float inverse_h) {
  precise float right_side = -residual * inverse_h;
  return right_side;
}

// Eliminates the link before from this one. `diagonal` = (w_from + w_to) slope + alpha/h^2 [1/kg], `min_pivot` the
// least share of it that a pivot has. `coupling`: effect of the previous link's impulse on this error; `ratio`:
// effect of this impulse on the previous error, over its pivot.
StripLink EliminateLink(DistanceError error, vec3 direction, float diagonal, float min_pivot,
                        float inverse_h, float coupling, float ratio, StripLink before) {
  precise float pivot = diagonal - coupling * ratio;
  precise float right_side = StripRightSide(error.residual, inverse_h) - coupling * before.right_side;
  precise float least = min_pivot * diagonal;
  float inverse_pivot = Quotient(1.0, max(pivot, least));
  precise float impulse = right_side * inverse_pivot;
  return StripLink(direction, error.direction, inverse_pivot, impulse);
}

#endif
