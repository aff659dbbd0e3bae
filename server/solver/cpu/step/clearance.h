// How far a particle stays from a collider: what is clear of it needs no look at its gap.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

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

// Of all particles from all near colliders, each number in rows of particles.
class Clearances {
 public:
  enum Number : uint32_t {
    kX,  // where the particle was when its gap was looked at
    kY,
    kZ,
    kWay,  // how far it can be from there without touching, while the collider rests [m]
    // Of a collider that moves: when it was, from the start of the step [s], and how far from the
    // collider's position the place was then [m].
    kTime,
    kArm,
    kNumbers
  };

  // Nothing is clear. Calls between() after each collider: many of them take long.
  template <class Between>
  void Reset(size_t particles, size_t colliders, const Between& between) {
    stride_ = particles + kMaxLanes;
    values_.reserve(stride_ * colliders * kNumbers);
    for (size_t k = 0; k < colliders; ++k) {
      values_.resize(std::max(values_.size(), stride_ * (k + 1) * kNumbers));
      std::fill_n(Row(k, kWay), stride_, -std::numeric_limits<float>::infinity());
      between();
    }
  }
  // [particle_count], and at least as many more as a register has lanes, to be read.
  float* Row(size_t k, Number number) { return values_.data() + (k * kNumbers + number) * stride_; }
  void Forget(size_t k, uint32_t i) { Row(k, kWay)[i] = -std::numeric_limits<float>::infinity(); }

 private:
  static constexpr size_t kMaxLanes = 16;

  size_t stride_ = 0;
  std::vector<float> values_;
};

}  // namespace drape::cpu
