// Stages `solve_contacts` and `correct_velocity`: colliders as implicit functions (Bender et al. 2009,
// section 4.1), contact impulses and Coulomb friction (server/solver/README.md).
#ifndef DRAPE_LIB_CONTACT_GLSL_
#define DRAPE_LIB_CONTACT_GLSL_

#include "lib/vector.glsl"

struct Collider {
  uint kind;      // DRAPE_COLLIDER_*
  float radius;   // sphere [m]
  vec3 point;     // sphere: centre; plane: a point on it [m]
  vec3 normal;    // plane: unit, away from the solid
};

struct Gap {
  float size;     // distance to the collider minus the cloth's thickness [m]
  vec3 normal;    // unit, outward
};

// At a sphere's centre the normal is +y.
Gap ColliderGap(Collider collider, float thickness, vec3 q) {
  precise vec3 from_point = q - collider.point;
  Gap gap;
  if (collider.kind == DRAPE_COLLIDER_SPHERE) {
    float length_d = Length(from_point);
    gap.normal = Direction(from_point, length_d, vec3(0.0, 1.0, 0.0));
    precise float size = length_d - collider.radius - thickness;
    gap.size = size;
  } else {
    gap.normal = collider.normal;
    precise float size = Dot(from_point, collider.normal) - thickness;
    gap.size = size;
  }
  return gap;
}

// Lowest gap that the end of the substep may have: 0, or for a particle that starts inside, no farther
// out than max_depenetration [m] above where it is.
float GapFloor(float gap_at_start, float max_depenetration) {
  precise float reachable = gap_at_start + max_depenetration;
  return min(0.0, reachable);
}

// beta_n' = max(beta_n - C/h, 0), the accumulated normal impulse times w [m/s].
float NormalBeta(float beta_n, float gap, float gap_floor, float inverse_h) {
  precise float wanted = beta_n - (gap - gap_floor) * inverse_h;
  return max(wanted, 0.0);
}

vec3 TangentialPart(vec3 u, vec3 normal) { return AddScaled(u, -Dot(u, normal), normal); }

// The accumulated tangential impulse times w [m/s] that stops the particle, held inside the Coulomb cone:
// beyond friction_static * beta_n it slides with friction_dynamic * beta_n.
vec3 TangentBeta(vec3 beta_t, vec3 u, vec3 normal, float beta_n, float friction_static,
                 float friction_dynamic) {
  precise vec3 wanted = beta_t - TangentialPart(u, normal);
  float length_wanted = Length(wanted);
  precise float stick_limit = friction_static * beta_n;
  if (length_wanted <= stick_limit) return wanted;
  if (beta_n == 0.0) return vec3(0.0);
  precise float share = friction_dynamic * beta_n / length_wanted;
  precise vec3 sliding = wanted * share;
  return sliding;
}

// Velocity after a contact: no approach along the normal, then Coulomb friction against what the normal
// part took away.
vec3 ContactVelocity(vec3 v, vec3 normal, float friction_static, float friction_dynamic) {
  float approach = -Dot(v, normal);
  if (approach <= 0.0) return v;
  vec3 tangential = AddScaled(v, approach, normal);
#ifdef HAS_FRICTION
  float speed = Length(tangential);
  precise float stick_limit = friction_static * approach;
  if (speed <= stick_limit) return vec3(0.0);
  precise float share = 1.0 - friction_dynamic * approach / speed;
  precise vec3 sliding = tangential * share;
  return sliding;
#else
  return tangential;
#endif
}

#endif
