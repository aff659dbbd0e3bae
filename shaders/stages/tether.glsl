// Stage `tether`. Needs the accessors of one plan. Pins are only read, so one phase for all particles.
#include "lib/tether.glsl"
#include "stages/substep.glsl"

// Where the tethers of a particle begin and end in their list.
uvec2 FindTethers(uint i) {
  uint word = cloth.model.tether_offsets + i;
  return uvec2(models[word], models[word + 1u]);
}

#ifdef OWNS_PARTICLE
uvec2 kept_tethers;
void KeepTethers(uint i) { kept_tethers = FindTethers(i); }
uvec2 TethersOf(uint i) { return kept_tethers; }
#else
uvec2 TethersOf(uint i) { return FindTethers(i); }
#endif

void TetherParticle(uint i) {
  uvec2 tethers = TethersOf(i);
  vec3 p = Position(i);
  vec3 predicted = Velocity(i);
  vec3 u = predicted;
  for (uint t = tethers.x; t < tethers.y; ++t) {
    uint pin = models[cloth.model.tethers + DRAPE_TETHER_WORDS * t];
    float reach = ModelFloat(cloth.model.tethers + DRAPE_TETHER_WORDS * t + 1u);
    precise vec3 position_difference = p - Position(pin);
    precise vec3 velocity_difference = u - Velocity(pin);
    vec3 d = AddScaled(position_difference, substep.interval, velocity_difference);
#ifdef HAS_IMPULSES
    vec3 before = u;
#endif
    u = TetheredVelocity(u, position_difference, d, reach, substep.inverse_interval,
                         cloth.step.end_share);
#ifdef HAS_IMPULSES
    precise vec3 impulse = ModelFloat(cloth.model.masses + i) * (before - u);
    if (impulse != vec3(0.0) && InverseMass(i) != 0.0) PullAtTether(t, impulse);
#endif
  }
  if (u != predicted && InverseMass(i) != 0.0) SetVelocity(i, u);
}
