// Colliders as particles meet them: at the start and at the end of the substep, and how fast their surfaces
// are. Without HAS_MOVING_COLLIDERS they rest as described. Needs the storage blocks.
#ifndef DRAPE_STAGES_COLLIDER_SURFACE_GLSL_
#define DRAPE_STAGES_COLLIDER_SURFACE_GLSL_

#include "stages/substep.glsl"

#ifdef HAS_MOVING_COLLIDERS
#include "lib/rigid_motion.glsl"

RigidMotion LoadMotion(uint c) {
  uint word = cloth.parameters.collider_motions + DRAPE_COLLIDER_MOTION_WORDS * c;
  RigidMotion motion;
  motion.pivot = ParameterVector(word);
  motion.position = ParameterVector(word + 3u);
  motion.rotation = mat3(ParameterVector(word + 6u), ParameterVector(word + 9u),
                         ParameterVector(word + 12u));
  motion.velocity = ParameterVector(word + 15u);
  motion.axis = ParameterVector(word + 18u);
  motion.angular_velocity = ParameterVector(word + 21u);
  motion.turns = Parameter(word + 24u);
  motion.chord_sine = Parameter(word + 25u);
  motion.chord_cosine = Parameter(word + 26u);
  return motion;
}

struct Surface {
  Collider collider;
  RigidMotion motion;
  Pose at_start;
  Pose at_end;
};

Surface LoadSurface(uint c) {
  RigidMotion motion = LoadMotion(c);
  return Surface(LoadCollider(c), motion, PoseAt(motion, substep_begin),
                 PoseAt(motion, substep_end));
}

// In its own frame a collider is as it was described.
Gap MovedGap(Surface surface, Pose pose, vec3 q) {
  vec3 described = DescribedPoint(surface.motion, pose, q);
  Gap gap = ColliderGap(surface.collider, cloth.step.thickness, described);
  gap.normal = PlacedDirection(surface.motion, pose, gap.normal);
  return gap;
}

Gap GapAtStart(Surface surface, vec3 p) { return MovedGap(surface, surface.at_start, p); }
Gap GapAtEnd(Surface surface, vec3 q) { return MovedGap(surface, surface.at_end, q); }
// Of the gap at q [m].
float RoundOffOf(Surface surface, vec3 q) {
  precise float size = SumOfSizes(q) + (SumOfSizes(surface.at_end.position) + SumOfSizes(surface.motion.pivot) +
                                        SumOfSizes(surface.collider.point));
  precise float round_off = TOUCH_ROUND_OFF * size;
  return round_off;
}
// v relative to the point of the surface that is at p before, or during, or q after the substep.
vec3 RelativeAtStart(Surface surface, vec3 p, vec3 v) {
  precise vec3 relative = v - PointVelocity(surface.motion, surface.at_start, p);
  return relative;
}
vec3 RelativeMean(Surface surface, vec3 p, vec3 u) {
  precise vec3 relative = u - MeanPointVelocity(surface.motion, surface.at_start, p);
  return relative;
}
// The same for where it goes during the substep [m].
vec3 RelativeWay(Surface surface, vec3 p, vec3 way) {
  precise vec3 of_surface = cloth.step.h * MeanPointVelocity(surface.motion, surface.at_start, p);
  precise vec3 relative = way - of_surface;
  return relative;
}
vec3 RelativeAtEnd(Surface surface, vec3 q, vec3 v) {
  precise vec3 relative = v - PointVelocity(surface.motion, surface.at_end, q);
  return relative;
}
vec3 AbsoluteAtEnd(Surface surface, vec3 q, vec3 relative) {
  precise vec3 v = PointVelocity(surface.motion, surface.at_end, q) + relative;
  return v;
}
#else
#define Surface Collider
#define LoadSurface LoadCollider

Gap GapAtStart(Collider collider, vec3 p) { return ColliderGap(collider, cloth.step.thickness, p); }
Gap GapAtEnd(Collider collider, vec3 q) { return ColliderGap(collider, cloth.step.thickness, q); }
float RoundOffOf(Collider collider, vec3 q) {
  precise float round_off = TOUCH_ROUND_OFF * (SumOfSizes(q) + SumOfSizes(collider.point));
  return round_off;
}
vec3 RelativeWay(Collider collider, vec3 p, vec3 way) { return way; }
vec3 RelativeAtStart(Collider collider, vec3 p, vec3 v) { return v; }
vec3 RelativeMean(Collider collider, vec3 p, vec3 u) { return u; }
vec3 RelativeAtEnd(Collider collider, vec3 q, vec3 v) { return v; }
vec3 AbsoluteAtEnd(Collider collider, vec3 q, vec3 relative) { return relative; }
#endif

#endif
