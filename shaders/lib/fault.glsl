// Stage `commit`: whether a particle's state can be kept.
#ifndef DRAPE_LIB_FAULT_GLSL_
#define DRAPE_LIB_FAULT_GLSL_

#include "lib/vector.glsl"

// Tests the bits, because compilers may assume that no NaN exists.
bool IsFinite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

// DRAPE_FAULT_* bits of a position [m] and a velocity [m/s].
uint FaultOf(vec3 p, vec3 v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!IsFinite(p[axis]) || !IsFinite(v[axis])) return DRAPE_FAULT_NOT_FINITE;
  }
  bool is_runaway = abs(p.x) > MAX_COORDINATE || abs(p.y) > MAX_COORDINATE ||
                    abs(p.z) > MAX_COORDINATE || Length(v) > MAX_SPEED;
  return is_runaway ? DRAPE_FAULT_RUNAWAY : 0u;
}

#endif
