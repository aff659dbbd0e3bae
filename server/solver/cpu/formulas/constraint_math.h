// The formulas of the step as pure functions; no state, no loops over particles. Those of
// constraints that both paths share are in constraint_math-inl.h. Symbols as in Bender et al. 2009
// and server/solver/method.md: p, v, u position, velocity, mean velocity over the substep; w
// inverse mass; h substep; C error; n direction; Lambda accumulated impulse; alpha compliance; beta
// impulse of a contact times w.
#pragma once

#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {

// Below this length [m] a difference of positions has no direction.
inline constexpr float kMinDirectionLength = static_cast<float>(kMinDirectionLength_m);

// Distance between two particles as predicted at the end of the substep (Bender et al. 2009,
// section 3.1, eq. 2, with q = p + h u): d = (p_j - p_i) + h (u_j - u_i). The difference of the old
// positions is exact for close particles, so the error does not see the rounding of a new position.
inline Vec4 PredictedDifference(Vec4 p_i, Vec4 p_j, Vec4 u_i, Vec4 u_j, float h) {
  return (p_j - p_i) + h * (u_j - u_i);
}

// Impulse that closes a point joint, along all axes at once: Delta Lambda = -r / h / (w_i + w_j +
// alpha/h^2), r = p_j - p_i + (alpha/h) Lambda (Bender et al. 2009, section 3.2, for the equality
// constraint p_j - p_i = 0).
inline Vec4 JointImpulse(Vec4 residual, float inverse_h, float inverse_mass_sum) {
  return -residual * inverse_h / inverse_mass_sum;
}

// A rest length that changes linearly within the step.
inline Vec4 LengthBetween(Vec4 start, Vec4 target, float share) {
  return start + (target - start) * share;
}

// Acceleration of particle i, before the factor w_i, from one spring to j (Bender et al. 2009,
// section 4.1): [k (|d| - l0) + c (v_j - v_i).n] n with n = d/|d|, d = p_j - p_i. No direction: no
// force.
inline Vec4 SpringForce(Vec4 p_i, Vec4 p_j, Vec4 v_i, Vec4 v_j, float rest_length, float stiffness,
                        float damping) {
  const Vec4 d = p_j - p_i;
  const float length = Length(d);
  if (length < kMinDirectionLength) return Vec4{};
  const Vec4 n = d / length;
  return (stiffness * (length - rest_length) + damping * Dot(v_j - v_i, n)) * n;
}

// Signed distance of a point from a collider and the outward normal there.
struct Gap {
  float gap;  // [m], < 0 inside
  Vec4 normal;
};

}  // namespace drape::cpu
