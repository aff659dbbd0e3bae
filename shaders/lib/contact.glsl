// Stages `solve_contacts` and `correct_velocity`: colliders as implicit functions (Bender et al. 2009,
// section 4.1), contact impulses and Coulomb friction (server/solver/method.md).
#ifndef DRAPE_LIB_CONTACT_GLSL_
#define DRAPE_LIB_CONTACT_GLSL_

#include "lib/vector.glsl"
#ifdef HAS_DISTANCE_MAP
#include "lib/distance_map.glsl"
#endif

// ColliderNumbers (server/scene/colliders.h).
struct Collider {
  uint kind;      // COLLIDER_*
  float radius;   // [m]
  vec3 point;     // [m]
  vec3 vector;
  mat3 axes;
#ifdef HAS_DISTANCE_MAP
  DistanceGrid grid;
#endif
};

struct Gap {
  float size;     // distance to the collider minus the cloth's thickness [m]
  vec3 normal;    // unit, outward
};

#ifdef HAS_CAPSULE
// The distance to the nearest point of the segment less the radius.
Gap CapsuleGap(Collider capsule, float thickness, vec3 from_a) {
  float length_sq = Dot(capsule.vector, capsule.vector);
  float along = 0.0;
  if (length_sq >= MIN_DIRECTION_LENGTH * MIN_DIRECTION_LENGTH) {
    precise float share = Dot(from_a, capsule.vector) / length_sq;
    along = clamp(share, 0.0, 1.0);
  }
  vec3 d = AddScaled(from_a, -along, capsule.vector);
  float length_d = Length(d);
  Gap gap;
  gap.normal = Direction(d, length_d, capsule.axes[0]);
  precise float size = length_d - capsule.radius - thickness;
  gap.size = size;
  return gap;
}

#endif

#ifdef HAS_BOX
// (1, 0, 0), (0, 1, 0) or (0, 0, 1): the largest component, of equals the first.
vec3 LargestComponent(vec3 v) {
  if (v.x >= v.y && v.x >= v.z) return vec3(1.0, 0.0, 0.0);
  return v.y >= v.z ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
}

// Inside and above a face the normal is the axis of the nearest face; elsewhere it comes from the nearest
// point, which differs by `outside`.
Gap BoxGap(Collider box, float thickness, vec3 from_center) {
  vec3 local = vec3(Dot(from_center, box.axes[0]), Dot(from_center, box.axes[1]),
                    Dot(from_center, box.axes[2]));
  vec3 side = vec3(local.x < 0.0 ? -1.0 : 1.0, local.y < 0.0 ? -1.0 : 1.0,
                   local.z < 0.0 ? -1.0 : 1.0);
  precise vec3 beyond = abs(local) - box.vector;
  vec3 outside = max(beyond, vec3(0.0));
  float size = Length(outside);
  int beyond_count = int(beyond.x > 0.0) + int(beyond.y > 0.0) + int(beyond.z > 0.0);
  precise vec3 direction;
  if (beyond_count > 1 && size >= MIN_DIRECTION_LENGTH) {
    direction = outside / size;
  } else {
    direction = LargestComponent(beyond);
    size = max(max(beyond.x, beyond.y), beyond.z);
  }
  precise vec3 normal = side.x * direction.x * box.axes[0] + side.y * direction.y * box.axes[1] +
                        side.z * direction.z * box.axes[2];
  precise float gap_size = size - thickness;
  return Gap(gap_size, normal);
}
#endif

#ifdef HAS_CYLINDER
// The normal is that of the side or the nearer end, whichever is nearest (of equals the side); beyond both it
// comes from the rim.
Gap CylinderGap(Collider cylinder, float thickness, vec3 from_center) {
  vec3 axis = cylinder.axes[0];
  float along = Dot(from_center, axis);
  vec3 across = AddScaled(from_center, -along, axis);
  float from_axis = Length(across);
  vec3 sideways = Direction(across, from_axis, cylinder.axes[1]);
  vec3 endways = along < 0.0 ? -axis : axis;
  precise vec2 beyond = vec2(from_axis, abs(along)) - cylinder.vector.xy;
  precise float rim_distance = sqrt(beyond.x * beyond.x + beyond.y * beyond.y);
  Gap gap;
  float size;
  if (min(beyond.x, beyond.y) > 0.0 && rim_distance >= MIN_DIRECTION_LENGTH) {
    precise vec3 normal = (beyond.x * sideways + beyond.y * endways) / rim_distance;
    gap.normal = normal;
    size = rim_distance;
  } else {
    gap.normal = beyond.x < beyond.y ? endways : sideways;
    size = max(beyond.x, beyond.y);
  }
  precise float gap_size = size - thickness;
  gap.size = gap_size;
  return gap;
}
#endif

#ifdef HAS_DISTANCE_MAP
// `corners`: the samples around `place`. The normal is the mesh's +y where the distance has no gradient.
Gap DistanceMapGap(Collider solid, float thickness, MapPlace place, CellCorners corners) {
  MapDistance map = DistanceInMap(solid.grid, place, corners);
  float slope = Length(map.gradient);
  Gap gap;
  precise float size = map.distance - thickness;
  gap.size = size;
  gap.normal = solid.axes[1];
  if (slope >= MIN_GRADIENT) {
    precise vec3 direction = map.gradient / slope;
    precise vec3 normal =
        direction.x * solid.axes[0] + direction.y * solid.axes[1] + direction.z * solid.axes[2];
    gap.normal = normal;
  }
  return gap;
}
#endif

// All shapes but distance maps. At a sphere's centre the normal is +y.
Gap ShapeGap(Collider collider, float thickness, vec3 q) {
  precise vec3 from_point = q - collider.point;
#ifdef HAS_CAPSULE
  if (collider.kind == COLLIDER_CAPSULE) return CapsuleGap(collider, thickness, from_point);
#endif
#ifdef HAS_BOX
  if (collider.kind == COLLIDER_BOX) return BoxGap(collider, thickness, from_point);
#endif
#ifdef HAS_CYLINDER
  if (collider.kind == COLLIDER_CYLINDER) return CylinderGap(collider, thickness, from_point);
#endif
  Gap gap;
  if (collider.kind == COLLIDER_SPHERE) {
    float length_d = Length(from_point);
    gap.normal = Direction(from_point, length_d, vec3(0.0, 1.0, 0.0));
    precise float size = length_d - collider.radius - thickness;
    gap.size = size;
  } else {
    gap.normal = collider.vector;
    precise float size = Dot(from_point, collider.vector) - thickness;
    gap.size = size;
  }
  return gap;
}

// Lowest gap that the end of the substep may have: 0, or for a particle that starts inside, no farther
// out than max_depenetration [m] above where it is.
float ContactFloor(float gap_at_start, float max_depenetration) {
  precise float reachable = gap_at_start + max_depenetration;
  return min(0.0, reachable);
}

// By how much a predicted gap is off the floor [m]. `way`: of the particle relative to the surface during the substep,
// along the normal. What is left of the gap without it is where the particle was before. If that is within `round_off`
// the particle was on the surface, and the way is known with all its digits.
float ContactError(float gap, float way, float round_off, float gap_floor) {
  precise float before = gap - way;
  precise float error = (abs(before) > round_off ? gap : way) - gap_floor;
  return error;
}

// Whether rounding of a particle's position counts as no error of its links: it touched the surface, its gap being
// within `touch_round_off` [m], and moved no faster than `slowest` [m/s] along it. `v`: relative to the surface; all
// before the substep.
bool Rests(float gap, float touch_round_off, vec3 v, float slowest) {
  precise float limit_sq = slowest * slowest;
  return abs(gap) <= touch_round_off && Dot(v, v) <= limit_sq;
}

// beta_n' = max(beta_n - C/h, 0), the accumulated normal impulse times w [m/s].
float NormalBeta(float beta_n, float error, float inverse_h) {
  precise float wanted = beta_n - error * inverse_h;
  return max(wanted, 0.0);
}

#ifdef HAS_RESTITUTION
// How fast a particle that hits is to leave [m/s]: restitution times the speed with which it reaches the
// surface from where it is before the substep; 0 where that is too slow, or where it approaches more slowly than
// gravity lets a free particle arrive so fast within the substep.
float ReboundSpeed(Gap at_start, vec3 v, vec3 gravity, float restitution, float slowest) {
  float approach = -Dot(v, at_start.normal);
  precise float gained = -2.0 * Dot(gravity, at_start.normal) * max(at_start.size, 0.0);
  precise float arrival_sq = approach * approach + gained;
  float arrival = sqrt(max(arrival_sq, 0.0));
  precise float rebound = restitution * arrival;
  return min(arrival, 2.0 * approach) > slowest ? rebound : 0.0;
}
#endif

vec3 TangentialPart(vec3 u, vec3 normal) { return AddScaled(u, -Dot(u, normal), normal); }

// The accumulated tangential impulse times w [m/s] of `wanted`, which stops the particle, of length `size`, held inside
// the Coulomb cone.
vec3 TangentBeta(vec3 wanted, float size, float beta_n, float friction) {
  precise float limit = friction * beta_n;
  if (size <= limit) return wanted;
  if (beta_n == 0.0) return vec3(0.0);
  precise float share = limit / size;
  precise vec3 sliding = wanted * share;
  return sliding;
}

// The friction of a contact in a substep.
struct Friction {
  float statics;   // coefficients
  float dynamics;
#ifdef HAS_TWO_FRICTIONS
  bool is_by_speed;  // else what the static one does not hold has the dynamic one
  float sliding_sq;  // square of how fast it slid when the substep began [m^2/s^2]
  float slowest;     // SlowestSlip [m/s]
#endif
};

#ifdef HAS_TWO_FRICTIONS
// How fast what has the dynamic friction has slid at least [m/s] (kSlipSubsteps).
float SlipSpeed(Friction friction, float beta_n) {
  precise float stops = SLIP_SUBSTEPS * friction.statics * max(friction.slowest, beta_n);
  return min(SLIP_SPEED, stops);
}
#endif

// The coefficient with which friction gives what it can of an impulse of `size`.
float CoefficientOf(Friction friction, float size, float beta_n) {
#ifdef HAS_TWO_FRICTIONS
  if (friction.is_by_speed) {
    precise float slip_sq = SlipSpeed(friction, beta_n) * SlipSpeed(friction, beta_n);
    return friction.sliding_sq > slip_sq ? friction.dynamics : friction.statics;
  }
#endif
  precise float limit = friction.statics * beta_n;
  return size > limit ? friction.dynamics : friction.statics;
}

// The normal impulse times w on which friction is judged with two steps [m/s]: the whole one of the substep, of which
// the sweeps have made `beta_n` so far. Nothing but `rebound` is left of the speed along the normal.
float WholeImpulse(float beta_n, float rebound, float normal_speed) {
  precise float impulse = beta_n + (rebound - normal_speed);
  return max(0.0, impulse);
}

// Velocity after a contact that the particle does not leave faster than `rebound` [m/s], or with two steps
// (`is_exact`) at exactly that speed along the normal, because u has the speed at which the error of the substep was
// removed. Coulomb friction is judged on the whole impulse of the substep, of which the sweeps made `beta_n` and
// `beta_t`. But with one step v also contains `kick`, the half step of gravity that constraints will take away in the
// next substep; what stops that has friction of its own.
vec3 VelocityAfterContact(vec3 v, vec3 normal, vec3 kick, vec3 beta_t, float beta_n, float rebound, bool is_exact,
                          Friction friction) {
  precise float change = rebound - Dot(v, normal);
  if (!is_exact && change <= 0.0) return v;
  vec3 left = TangentialPart(v, normal);
#ifdef HAS_FRICTION
  vec3 tangential_kick = TangentialPart(kick, normal);
  float normal_kick = is_exact ? 0.0 : max(0.0, min(change, -Dot(kick, normal)));
  if (!is_exact) left = AddScaled(left, -1.0, tangential_kick);
  precise float impulse = max(0.0, beta_n + (change - normal_kick));
  precise vec3 wanted = beta_t - TangentialPart(left, normal);
  float size = Length(wanted);
  precise vec3 more = TangentBeta(wanted, size, impulse, CoefficientOf(friction, size, impulse)) - beta_t;
  left = AddScaled(left, 1.0, more);
  if (!is_exact) {
    left = AddScaled(left, 1.0, tangential_kick);
    wanted = -TangentialPart(left, normal);
    size = Length(wanted);
    vec3 of_kick = TangentBeta(wanted, size, normal_kick, CoefficientOf(friction, size, normal_kick));
    left = AddScaled(left, 1.0, of_kick);
  }
#endif
#ifdef HAS_RESTITUTION
  left = AddScaled(left, rebound, normal);
#endif
  return left;
}

#ifdef HAS_TWO_STEPS
// Whether a particle hits: it approaches faster than one that rests or slides could. `v`: relative to the surface
// before the substep.
bool IsLanding(vec3 v, vec3 normal, float slowest) {
  precise float limit = slowest + GRAZING_SINE * Length(v);
  return -Dot(v, normal) > limit;
}
#endif

#endif
