// Eight paths of one cloth side by side: what the templates of `step/` that solve paths need of its
// particles. Compiled once per instruction set.
#if defined(DRAPE_CPU_ALONE_EIGHT_PATHS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_ALONE_EIGHT_PATHS_INL_H_
#undef DRAPE_CPU_ALONE_EIGHT_PATHS_INL_H_
#else
#define DRAPE_CPU_ALONE_EIGHT_PATHS_INL_H_
#endif

#include <hwy/highway.h>

#include <array>

#include "server/solver/cpu/simd/vec8-inl.h"
#include "server/solver/cpu/step/step_context.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

class EightPaths {
 public:
  using Scalars = Vec8;
  using Vectors = Vectors8;
  using Ends = std::array<uint32_t, kVec8Size>;

  explicit EightPaths(const StepContext& context)
      : EightPaths(context, context.substep.interval, context.substep.inverse_interval) {}
  // Particles are predicted after `interval`.
  EightPaths(const StepContext& context, float interval, float inverse_interval)
      : context_(context),
        interval_(interval),
        inverse_interval_(inverse_interval),
        p_(context.scratch.state.positions.data()),
        u_(context.scratch.state.velocities.data()) {}

  float interval() const { return interval_; }
  float inverse_interval() const { return inverse_interval_; }
  float inverse_force_time() const { return context_.substep.inverse_force_time; }
  float force_time() const { return context_.substep.force_time; }
  float largest_force_interval() const {
    return static_cast<float>(context_.controls.plan.schedule.largest_force_interval_s2());
  }
  static Vec8 Splat(float value) { return Splat8(value); }
  static Vec8 Number(const Numbers8& numbers) { return Load(numbers); }

  Vectors8 PositionDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, p_);
  }
  Vectors8 VelocityDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, u_);
  }

  // Differences of the positions at the end of the substep, with half the shuffles.
  HWY_INLINE Vectors8 PredictedDifferences(const Ends& from, const Ends& to) const {
    const Vec8 interval = Splat8(this->interval());
    VectorPairs d;
#pragma GCC unroll 4  // so that they stay in registers
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      d[k] = Difference(from, to, k, p_) + interval * Difference(from, to, k, u_);
    }
    return Transpose(d);
  }

  // Pins are left alone: paths that another thread solves may be reading them.
  HWY_INLINE void Push(const Ends& particles, bool has_pins, const Vectors8& change) const {
    const VectorPairs changes = Transpose(change);
    const bool checks = has_pins || context_.held.has_grips;
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const uint32_t i = particles[k], j = particles[k + kVec4Size];
      const auto [low, high] = SplitVectors(changes[k]);
      if (!checks || context_.held.IsFree(i)) u_[i] += low;
      if (!checks || context_.held.IsFree(j)) u_[j] += high;
    }
  }

  // of_held(lane, vector) of the vectors of held particles.
  template <class OfHeld>
  void ForHeld(const Ends& particles, const Vectors8& vectors, const OfHeld& of_held) const {
    const VectorPairs pairs = Transpose(vectors);
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const auto [low, high] = SplitVectors(pairs[k]);
      if (IsHeld(particles[k])) of_held(k, low);
      if (IsHeld(particles[k + kVec4Size])) of_held(k + kVec4Size, high);
    }
  }
  // Of paths of which no two have a particle in common.
  void Pull(const Ends& particles, bool has_pins, const Vectors8& impulses) const {
    if (!has_pins && !context_.held.has_grips) return;
    ForHeld(particles, impulses, [&](uint32_t lane, Vec4 impulse) {
      context_.impulses()->Pull(particles[lane], impulse);
    });
  }

 protected:
  const StepContext& context() const {
    return context_;
  }

 private:
  bool IsHeld(uint32_t i) const {
    return i != context_.model.spare_particle() && !context_.held.IsFree(i);
  }
  HWY_INLINE static Vectors8 Differences(const Ends& from, const Ends& to, const Vec4* values) {
    VectorPairs d;
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) d[k] = Difference(from, to, k, values);
    return Transpose(d);
  }
  // The differences of paths k and k + 4.
  static Vec8 Difference(const Ends& from, const Ends& to, uint32_t k, const Vec4* values) {
    return VectorsAt(to, k, values) - VectorsAt(from, k, values);
  }
  static Vec8 VectorsAt(const Ends& particles, uint32_t k, const Vec4* values) {
    return JoinVectors(values[particles[k]], values[particles[k + kVec4Size]]);
  }

  const StepContext& context_;
  const float interval_, inverse_interval_;
  const Vec4* const p_;
  Vec4* const u_;
};

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
