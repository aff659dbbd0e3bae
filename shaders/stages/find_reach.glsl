// The start of a step: finds the range in which the free particles are expected to stay, and the colliders that
// nothing touches there (server/solver/gl_compute/design.md, «Decisions»). Needs the accessors of
// one plan.
#ifndef DRAPE_STAGES_FIND_REACH_GLSL_
#define DRAPE_STAGES_FIND_REACH_GLSL_

#include "stages/collider_reach.glsl"
#include "stages/collider_surface.glsl"

#ifdef HAS_COLLIDER_REACH
const float kLeastFloat = -3.402823e38;

// Rounding of a gap, as a share of the lengths that it is computed from: each of its operations, fewer than 64,
// is off by at most 2^-24 of them, a division or root by five times as much.
const float kGapRounding = 1.0 / 131072.0;

shared uint shared_range[DRAPE_RANGE_WORDS];

// Over some free particles and pins: the largest -p, p [m], v^2 [m^2/s^2] and square of a pin's way [m^2].
struct Spread {
  vec3 below;
  vec3 above;
  float speed_sq;
  float pin_way_sq;
};

Spread NoSpread() { return Spread(vec3(kLeastFloat), vec3(kLeastFloat), 0.0, 0.0); }

void SpreadOver(uint i, inout Spread spread) {
  if (InverseMass(i) == 0.0) return;
  vec3 p = Position(i);
  vec3 v = Velocity(i);
  spread.below = max(spread.below, -p);
  spread.above = max(spread.above, p);
  spread.speed_sq = max(spread.speed_sq, Dot(v, v));
}

void SpreadOverPin(uint k, inout Spread spread) {
  uint i = PinParticle(k);
  if (IsOpen(i)) return;
  precise vec3 way = PinTarget(k) - Position(i);
  spread.pin_way_sq = max(spread.pin_way_sq, Dot(way, way));
}

// In uniform control flow, like AddToSharedRange; each needs a barrier after it.
void ClearSharedRange() {
  if (gl_LocalInvocationID.x != 0u) return;
  for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) shared_range[k] = 0u;
}

void AddToSharedRange(Spread spread) {
  float largest[DRAPE_RANGE_WORDS] =
      float[DRAPE_RANGE_WORDS](spread.below.x, spread.below.y, spread.below.z, spread.above.x,
                               spread.above.y, spread.above.z, spread.speed_sq, spread.pin_way_sq);
  for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) atomicMax(shared_range[k], OrderedBits(largest[k]));
}

// The collider, or where it is not convex the box around it: with the same gap or a smaller one wherever that
// is above 0.
Collider ConvexBound(Collider collider) {
#ifdef HAS_DISTANCE_MAP
  if (collider.kind != COLLIDER_DISTANCE_MAP) return collider;
  collider.kind = COLLIDER_BOX;
  collider.vector = 0.5 * collider.grid.cell * vec3(collider.grid.sample_counts - 1u);
  collider.point += collider.axes * collider.vector;
#endif
  return collider;
}

// Whether all gaps to a convex surface in the range are larger than `way`. A convex body lies behind the plane
// through its point that is nearest to some x, across the line to x: so for every y in the range
// gap(y) >= gap(x) + (y - x).n. The next x is the place in the range that is nearest to that point, or rather
// to the one `offset` further inside (a sphere's centre, on a capsule's segment), which gets there sooner. May
// say no for the corners of boxes that are hardly apart. `size`: the lengths that gaps are computed from [m].
bool IsApart(Surface surface, float offset, float way, float size) {
  vec3 x = 0.5 * (range.low + range.high);
  for (uint k = 0u; k < REACH_DIRECTIONS; ++k) {
    Gap at_x = GapAtStart(surface, x);
    if (!(at_x.size > 0.0)) return false;
    vec3 nearest = mix(range.low, range.high, lessThan(at_x.normal, vec3(0.0)));
    vec3 farthest_from_x = max(range.high - x, x - range.low);
    // The direction is rounded more where it comes from a small difference.
    float rounding = kGapRounding * size * (1.0 + Length(farthest_from_x) / at_x.size);
    precise float least_gap = at_x.size + Dot(nearest - x, at_x.normal);
    if (least_gap > way + rounding) return true;
    x = clamp(x - (at_x.size + offset) * at_x.normal, range.low, range.high);
  }
  return false;
}

// Whether a particle in the range may touch collider c within the step.
bool MayMeet(uint c) {
  Collider shape = ConvexBound(LoadCollider(c));
  float offset = shape.radius + cloth.step.thickness;
  float size = Length(max(abs(range.low), abs(range.high))) + Length(shape.point) +
               Length(shape.vector) + offset;
#ifdef HAS_MOVING_COLLIDERS
  // Gaps change no faster than the body's points move that are where they are taken.
  RigidMotion motion = LoadMotion(c);
  Pose pose = PoseAt(motion, 0.0);
  float duration = float(cloth.step.substeps) * cloth.step.h;
  float shift = Length(motion.velocity) * duration;
  float from_pivot =
      Length(max(abs(range.low - motion.position), abs(range.high - motion.position))) + shift;
  float way = shift + Length(motion.angular_velocity) * duration * from_pivot;
  size += Length(motion.position) + Length(motion.pivot) + way;
  return !IsApart(Surface(shape, motion, pose, pose), offset, way, size);
#else
  return !IsApart(shape, offset, 0.0, size);
#endif
}
#endif

#endif
