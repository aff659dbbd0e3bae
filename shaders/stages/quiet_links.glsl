// Which particles have quiet links. Needs the accessors of one plan.
#include "stages/collider_reach.glsl"
#include "stages/collider_surface.glsl"

#ifdef HAS_QUIET_LINKS
// Whether a particle rests on a collider, by its position and velocity before the substep.
bool RestsOnCollider(uint i) {
  vec3 p = Position(i);
  for (uint c = NextCollider(0u, 0u, p); c < cloth.collider_count; c = NextCollider(c + 1u, 0u, p)) {
    Surface surface = LoadSurface(c);
    vec3 v = RelativeAtStart(surface, p, Velocity(i));
    if (Rests(GapAtStart(surface, p).size, RoundOffOf(surface, p), v, cloth.step.slowest_landing)) return true;
  }
  return false;
}

// What rounding of the particle's position, here b, may add to the errors of its links [m].
float QuietRoundOff(uint i, vec3 position) {
  precise float round_off = QUIET_ROUND_OFF * SumOfSizes(position);
  return IsQuiet(i) ? round_off : 0.0;
}
#endif
