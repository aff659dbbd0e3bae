// How far a particle stays from a collider: what is clear of it needs no look at its gap.
#pragma once

#include <limits>

#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// Gaps grow and shrink by no more than the particle moves, those of distance maps by no more than
// twice that: each component of the gradient of an interpolation is at most 1, and outside the
// grid that of the way to it is added.
inline constexpr float kMapSlope = 2;
// Of a gap this share may be relied on [-]: what is left is for the rounding of what the particle
// moves and of the larger coordinates where it comes to be. Smaller: more looks at gaps.
inline constexpr float kReliableShare = 0.999f;
// And it is this many round-offs of the gap less (kTouchRoundOff): those of both gaps, and those
// within which a particle touches, or its way is measured from the surface (ContactError).
inline constexpr float kClearRoundOffs = 4;

// Of one particle from one collider.
struct Clearance {
  Vec4 place{};  // where the particle was when its gap was looked at
  // How far it can be from there without touching, while the collider rests [m].
  float way = -std::numeric_limits<float>::infinity();
  // Of a collider that moves: when it was, from the start of the step [s], and how far from the
  // collider's position the place was then [m].
  float at_s = 0;
  float arm = 0;
};

inline float ClearWay(const FloatCollider& collider, float gap, float round_off) {
  const float reliable = kReliableShare * gap - kClearRoundOffs * round_off;
  return collider.kind == ShapeKind::kDistanceMap ? reliable / kMapSlope : reliable;
}

// `surface_way`: how far the collider may have come at the place since [m].
inline bool IsClear(const Clearance& clearance, Vec4 q, float surface_way) {
  const float way = clearance.way - surface_way;
  const Vec4 d = q - clearance.place;
  return way > 0 && Dot(d, d) < way * way;  // not, if q is no number
}

}  // namespace drape::cpu
