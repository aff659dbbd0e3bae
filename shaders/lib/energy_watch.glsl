// Stage `commit`: the most energy that a step may add (server/solver/method.md, "Energy watch").
#ifndef DRAPE_LIB_ENERGY_WATCH_GLSL_
#define DRAPE_LIB_ENERGY_WATCH_GLSL_

#include "lib/fault.glsl"
#include "lib/vector.glsl"

// m (|v_1|^2 - |v_0|^2) / 2 - m g.(p_1 - p_0) [J], from v_0, v_1 - v_0, p_1 - p_0: with all digits.
float EnergyGain(float mass, vec3 v, vec3 v_change, vec3 p_change, vec3 gravity) {
  precise vec3 v_mean = v + 0.5 * v_change;
  precise float gain = mass * (Dot(v_change, v_mean) - Dot(gravity, p_change));
  return gain;
}

// `start`: kinetic and stored energy when the step begins [J]; `constant` [J], `lag_root` [J^1/2]: EnergyLimit
// (server/solver/energy_watch.h). A gain that is not a finite number is too much.
bool ExceedsEnergyLimit(float gain, vec2 start, float constant, float lag_root) {
  precise float limit = constant + MAX_ENERGY_GAIN * (start.x + start.y) + lag_root * sqrt(start.x);
  return !IsFinite(gain) || gain > limit;
}

#endif
