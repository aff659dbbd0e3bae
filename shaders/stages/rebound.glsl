// Rebound speeds of particles that hit colliders, kept in Scratch from `predict` to `correct_velocity`. Needs the
// accessors of one plan.
#include "stages/collider_surface.glsl"

#ifdef HAS_RESTITUTION
uint ReboundWord(uint collider, uint i) {
  return cloth.scratch.rebounds + collider * cloth.particle_count + i;
}

// From position and velocity before the substep.
void StoreRebounds(uint i) {
  for (uint c = 0u; c < cloth.collider_count; ++c) {
    Surface surface = LoadSurface(c);
    vec3 v = RelativeAtStart(surface, Position(i), Velocity(i));
    scratch[ReboundWord(c, i)] = ReboundSpeed(GapAtStart(surface, Position(i)), v, cloth.step.gravity.xyz,
                                              cloth.step.restitution, cloth.step.slowest_rebound);
  }
}
#endif

// How fast the particle is to leave the collider if it hits it [m/s].
float Rebound(uint collider, uint i) {
#ifdef HAS_RESTITUTION
  return scratch[ReboundWord(collider, i)];
#else
  return 0.0;
#endif
}
