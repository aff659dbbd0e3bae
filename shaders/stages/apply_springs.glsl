// Stage `apply_springs`. Two phases, so that all accelerations come from the same velocities:
// accelerations, then kicks. Needs the accessors of one plan.
#include "lib/spring.glsl"
#include "lib/vector.glsl"
#include "stages/kick.glsl"

// A_i = w_i * sum of the forces of the springs of i, in list order.
void StoreSpringAcceleration(uint i, uint place) {
  uint begin = models[cloth.model.spring_offsets + i];
  uint end = models[cloth.model.spring_offsets + i + 1u];
  vec3 p = KickPosition(i, place);
  vec3 v = Velocity(i);
  precise vec3 force = vec3(0.0);
  for (uint s = begin; s < end; ++s) {
    uint word = cloth.model.spring_ends + DRAPE_SPRING_END_WORDS * s;
    uint other = models[word];
    force = force + SpringForce(KickPosition(other, place) - p, Velocity(other) - v, ModelFloat(word + 1u),
                                ModelFloat(word + 2u), ModelFloat(word + 3u));
  }
#ifdef HAS_IMPULSES
#ifdef HAS_SPRING_FORCES
  float seconds = substep.interval;
#else
  float seconds = KickSeconds(place);
#endif
  precise vec3 impulse = seconds * force;
  if (InverseMass(i) == 0.0) Pull(i, impulse);
#endif
  precise vec3 acceleration = InverseMass(i) * force;
  SetScratchVector(cloth.scratch.spring_accelerations + 3u * i, acceleration);
}

// v += seconds * A_i; only their targets move pins.
void KickParticle(uint i, float seconds) {
  if (InverseMass(i) == 0.0) return;
  vec3 acceleration = ScratchVector(cloth.scratch.spring_accelerations + 3u * i);
  SetVelocity(i, AddScaled(Velocity(i), seconds, acceleration));
}
