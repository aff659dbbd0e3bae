// The formulas of the step as pure functions; no state, no loops over particles. Those of
// constraints that both paths share are in constraint_math-inl.h. Symbols as in Bender et al. 2009
// and server/solver/method.md: p, v, u position, velocity, mean velocity over the substep; w
// inverse mass; h substep; C error; n direction; Lambda accumulated impulse; alpha compliance; beta
// impulse of a contact times w.
#pragma once

#include <limits>

#include "server/scene/elastic_elements.h"
#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {

// Below this length [m] a difference of positions has no direction.
inline constexpr float kMinDirectionLength = static_cast<float>(kMinDirectionLength_m);
// kTouchRoundOffs and kQuietRoundOffs, relative to the numbers that are rounded.
inline constexpr float kRoundOff = std::numeric_limits<float>::epsilon() / 2;
inline constexpr float kTouchRoundOff = static_cast<float>(kTouchRoundOffs) * kRoundOff;
inline constexpr float kQuietRoundOff = static_cast<float>(kQuietRoundOffs) * kRoundOff;

// Distance between two particles as predicted at the end of the substep (Bender et al. 2009,
// section 3.1, eq. 2, with q = p + h u): d = (p_j - p_i) + h (u_j - u_i). The difference of the old
// positions is exact for close particles, so the error does not see the rounding of a new position.
inline Vec4 PredictedDifference(Vec4 p_i, Vec4 p_j, Vec4 u_i, Vec4 u_j, float h) {
  return (p_j - p_i) + h * (u_j - u_i);
}

// A rest length that changes linearly within the step.
inline Vec4 LengthBetween(Vec4 start, Vec4 target, float share) {
  return start + (target - start) * share;
}

// Signed distance of a point from a collider and the outward normal there.
struct Gap {
  float gap;  // [m], < 0 inside
  Vec4 normal;
};

}  // namespace drape::cpu
