// Distance constraints that only pull (ropes) or only push (struts). Bender et al. 2009, section 3.2,
// inequality constraints.
#ifndef DRAPE_LIB_INEQUALITY_GLSL_
#define DRAPE_LIB_INEQUALITY_GLSL_

#include "interface/bindings.h"

// The part of an impulse [N s] that keeps the sign of the accumulated one legal: a rope's is never positive, a
// strut's never negative.
float ClampImpulse(uint kind, float lambda, float impulse) {
  precise float accumulated = lambda + impulse;
  if (kind == DRAPE_KIND_AT_MOST) accumulated = min(accumulated, 0.0);
  if (kind == DRAPE_KIND_AT_LEAST) accumulated = max(accumulated, 0.0);
  precise float change = accumulated - lambda;
  return kind == DRAPE_KIND_EQUAL ? impulse : change;
}

// The part of an error [m] that the kind forbids: none for a slack rope.
float Violation(uint kind, float error) {
  if (kind == DRAPE_KIND_AT_MOST) return max(error, 0.0);
  if (kind == DRAPE_KIND_AT_LEAST) return min(error, 0.0);
  return error;
}

// The part of an error [m] that an impulse may still remove: an inequality can at most undo its impulses so far.
// Inverse masses [1/kg].
float AdmissibleError(uint kind, float error, float lambda, float inverse_mass_sum, float compliance,
                      float h, float inverse_h) {
  if (kind == DRAPE_KIND_EQUAL) return error;
  precise float undone = (h * inverse_mass_sum + compliance * inverse_h) * lambda;
  return kind == DRAPE_KIND_AT_MOST ? max(error, undone) : min(error, undone);
}

#endif
