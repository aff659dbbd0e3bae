// Stage `tether`. Needs the accessors of one plan. Pins are only read, so one phase for all particles.
#include "lib/tether.glsl"
#include "stages/substep.glsl"

void TetherParticle(uint i) {
  uint end = models[cloth.model.tether_offsets + i + 1u];
  vec3 p = Position(i);
  vec3 u = Velocity(i);
  for (uint t = models[cloth.model.tether_offsets + i]; t < end; ++t) {
    uint pin = models[cloth.model.tethers + DRAPE_TETHER_WORDS * t];
    float reach = ModelFloat(cloth.model.tethers + DRAPE_TETHER_WORDS * t + 1u);
    precise vec3 position_difference = p - Position(pin);
    precise vec3 velocity_difference = u - Velocity(pin);
    vec3 d = AddScaled(position_difference, substep.interval, velocity_difference);
    u = TetheredVelocity(u, position_difference, d, reach, substep.inverse_interval,
                         cloth.step.end_share);
  }
  if (InverseMass(i) != 0.0) SetVelocity(i, u);
}
