// The formulas of the step as pure functions; no state, no loops over particles. Those of
// constraints that both paths share are in constraint_math-inl.h. Symbols as in Bender et al. 2009
// and server/solver/method.md: p, v, u position, velocity, mean velocity over the substep; w
// inverse mass; h substep; C error; n direction; Lambda accumulated impulse; alpha compliance; beta
// impulse of a contact times w.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {

// Below this length [m] a difference of positions has no direction.
inline constexpr float kMinDirectionLength = static_cast<float>(kMinDirectionLength_m);

// Distance between two particles as predicted at the end of the substep (Bender et al. 2009,
// section 3.1, eq. 2, with q = p + h u): d = (p_j - p_i) + h (u_j - u_i). The difference of the old
// positions is exact for close particles, so the error does not see the rounding of a new position.
inline Lanes PredictedDifference(Lanes p_i, Lanes p_j, Lanes u_i, Lanes u_j, float h) {
  return (p_j - p_i) + h * (u_j - u_i);
}

// Impulse that closes a point joint, along all axes at once: Delta Lambda = -r / h / (w_i + w_j +
// alpha/h^2), r = p_j - p_i + (alpha/h) Lambda (Bender et al. 2009, section 3.2, for the equality
// constraint p_j - p_i = 0).
inline Lanes JointImpulse(Lanes residual, float inverse_h, float inverse_mass_sum) {
  return -residual * inverse_h / inverse_mass_sum;
}

// A rest length that changes linearly within the step.
inline Lanes LengthBetween(Lanes start, Lanes target, float share) {
  return start + (target - start) * share;
}

// Acceleration of particle i, before the factor w_i, from one spring to j (Bender et al. 2009,
// section 4.1): [k (|d| - l0) + c (v_j - v_i).n] n with n = d/|d|, d = p_j - p_i. No direction: no
// force.
inline Lanes SpringForce(Lanes p_i, Lanes p_j, Lanes v_i, Lanes v_j, float rest_length,
                         float stiffness, float damping) {
  const Lanes d = p_j - p_i;
  const float length = Length(d);
  if (length < kMinDirectionLength) return Lanes{};
  const Lanes n = d / length;
  return (stiffness * (length - rest_length) + damping * Dot(v_j - v_i, n)) * n;
}

// Signed distance of a point from a collider and the outward normal there.
struct Gap {
  float gap;  // [m], < 0 inside
  Lanes normal;
};

// `offset` = radius + thickness. The centre pushes along +y.
inline Gap SphereGap(Lanes q, Lanes center, float offset) {
  const Lanes d = q - center;
  const float distance = Length(d);
  if (distance < kMinDirectionLength) return {distance - offset, Lanes{0, 1, 0, 0}};
  return {distance - offset, d / distance};
}

// `offset` = thickness.
inline Gap PlaneGap(Lanes q, Lanes point, Lanes normal, float offset) {
  return {Dot(q - point, normal) - offset, normal};
}

// `segment` from a to b; `offset` = radius + thickness; on the segment `axis_normal` pushes.
inline Gap CapsuleGap(Lanes q, Lanes a, Lanes segment, Lanes axis_normal, float offset) {
  constexpr float kMinLengthSq = kMinDirectionLength * kMinDirectionLength;
  const Lanes from_a = q - a;
  const float length_sq = Dot(segment, segment);
  const float along =
      length_sq < kMinLengthSq ? 0 : std::clamp(Dot(from_a, segment) / length_sq, 0.0f, 1.0f);
  const Lanes d = from_a - along * segment;
  const float distance = Length(d);
  if (distance < kMinDirectionLength) return {distance - offset, axis_normal};
  return {distance - offset, d / distance};
}

// `axes`: the box's unit axes; `offset` = thickness. Inside and above a face the normal is the
// axis of the nearest face (of equals the first), elsewhere it comes from the nearest point.
inline Gap BoxGap(Lanes q, Lanes center, Lanes half_extents, const std::array<Lanes, 3>& axes,
                  float offset) {
  const Lanes d = q - center;
  float side[3], beyond[3], outside[3];
  uint32_t nearest_face = 0, beyond_count = 0;
  for (uint32_t k = 0; k < 3; ++k) {
    const float local = Dot(d, axes[k]);
    side[k] = local < 0 ? -1.0f : 1.0f;
    beyond[k] = std::fabs(local) - half_extents[k];
    outside[k] = std::max(beyond[k], 0.0f);
    if (beyond[k] > 0) ++beyond_count;
    if (beyond[k] > beyond[nearest_face]) nearest_face = k;
  }
  const float distance =
      std::sqrt(outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2]);
  if (beyond_count > 1 && distance >= kMinDirectionLength) {
    Lanes from_nearest{};
    for (uint32_t k = 0; k < 3; ++k) from_nearest += side[k] * outside[k] * axes[k];
    return {distance - offset, from_nearest / distance};
  }
  return {beyond[nearest_face] - offset, side[nearest_face] * axes[nearest_face]};
}

// Lowest gap that a contact accepts at the end of the substep: what starts deep inside comes out at
// most at kMaxDepenetrationSpeed_m_per_s (floor = min(0, gap(p) + speed h)).
inline float ContactFloor(float gap_at_start, float depenetration_distance) {
  return std::min(0.0f, gap_at_start + depenetration_distance);
}

// New accumulated normal impulse times w of the inequality constraint C_contact >= 0 (Bender et al.
// 2009, section 4.3); the sum, not the single impulse, must not pull: max(beta - C/h, 0).
inline float ContactImpulse(float beta_normal, float error, float inverse_h) {
  return std::max(beta_normal - error * inverse_h, 0.0f);
}

inline Lanes Tangential(Lanes u, Lanes n) {
  return u - Dot(u, n) * n;
}

// New accumulated friction impulse times w: the one that stops the tangential velocity, limited by
// Coulomb's law (a velocity constraint in the sense of Bender et al. 2009, section 3.2; formula
// from the README of server/solver): b = beta_t - u_t, and if |b| > mu_s beta_n, b mu_d beta_n /
// |b|.
inline Lanes FrictionImpulse(Lanes beta_tangent, Lanes tangential_velocity, float beta_normal,
                             float friction_static, float friction_dynamic) {
  const Lanes b = beta_tangent - tangential_velocity;
  const float length = Length(b);
  if (length > friction_static * beta_normal) return b * (friction_dynamic * beta_normal / length);
  return b;
}

// How fast a particle that hits is to leave [m/s]: `restitution` times the speed with which it
// reaches the surface from where it is before the substep; 0 where it approaches too slowly.
inline float ReboundSpeed(const Gap& at_start, Lanes v, Lanes gravity, float restitution,
                          float slowest) {
  const float approach = -Dot(v, at_start.normal);
  if (approach <= slowest) return 0;
  const float gained = -2 * Dot(gravity, at_start.normal) * std::max(at_start.gap, 0.0f);
  return restitution * std::sqrt(std::max(approach * approach + gained, 0.0f));
}

// Velocity after a contact that the particle approaches (v.n < 0): no normal part, and the
// tangential part less Coulomb friction of the same impulse (a velocity constraint, Bender et al.
// 2009, section 3.2).
inline Lanes VelocityAfterContact(Lanes v, Lanes n, float friction_static, float friction_dynamic) {
  const float normal_speed = Dot(v, n);
  if (!(normal_speed < 0)) return v;
  const Lanes tangential = v - normal_speed * n;
  const float speed = Length(tangential);
  if (speed <= friction_static * -normal_speed) return Lanes{};
  return tangential * (1.0f - friction_dynamic * -normal_speed / speed);
}

// The same where the particle leaves with the speed `rebound` along the normal, unless it is faster
// already.
inline Lanes VelocityAfterHit(Lanes v, Lanes n, float rebound, float friction_static,
                              float friction_dynamic) {
  const float normal_speed = Dot(v, n);
  const float impulse = rebound - normal_speed;
  if (!(impulse > 0)) return v;
  const Lanes tangential = v - normal_speed * n;
  const float speed = Length(tangential);
  if (speed <= friction_static * impulse) return rebound * n;
  return tangential * (1.0f - friction_dynamic * impulse / speed) + rebound * n;
}

}  // namespace drape::cpu
