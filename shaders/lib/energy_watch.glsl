// Stage `commit`: the most energy that a step may add (server/solver/method.md, "Energy watch").
#ifndef DRAPE_LIB_ENERGY_WATCH_GLSL_
#define DRAPE_LIB_ENERGY_WATCH_GLSL_

#include "lib/vector.glsl"

// m (|v_1|^2 - |v_0|^2) / 2 - m g.(p_1 - p_0) [J], from v_0, v_1 - v_0, p_1 - p_0: with all digits.
float EnergyGain(float mass, vec3 v, vec3 v_change, vec3 p_change, vec3 gravity) {
  precise vec3 v_mean = v + 0.5 * v_change;
  precise float gain = mass * (Dot(v_change, v_mean) - Dot(gravity, p_change));
  return gain;
}

// By the bits, because compilers may assume that no NaN exists.
bool IsNaN(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }

// `start`: kinetic and compliant energy when the step begins [J]; `constant` [J], `lag_root` [J^1/2]: EnergyLimit
// (server/solver/energy_watch.h).
bool ExceedsEnergyLimit(float gain, vec2 start, float constant, float lag_root) {
  precise float limit = constant + MAX_ENERGY_GAIN * (start.x + start.y) + lag_root * sqrt(start.x);
  return !IsNaN(gain) && !IsNaN(limit) && gain > limit;
}

#endif
