#include "server/solver/cpu/alone/strips.h"

#include <array>
#include <span>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/strips.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/simd/vec8-inl.h"
#include "server/solver/cpu/step/strip_solve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Eight strips of a phase: what strip_solve-inl.h sweeps over.
class EightStrips {
 public:
  using Scalars = Vec8;
  using Vectors = Vectors8;
  using Mask = Mask8;
  using Ends = std::array<uint32_t, kVec8Size>;
  using Link = StripLink;
  using Group = StripGroup;

  // Group `index` of the model, by a member of the team.
  EightStrips(const StepContext& context, size_t index, uint32_t member)
      : context_(context),
        p_(context.scratch.state.positions.data()),
        u_(context.scratch.state.velocities.data()),
        groups_(&context.model.strips[index], 1),
        scratch_(context.scratch.strips[member]) {}

  std::span<const StripGroup> groups() const { return groups_; }
  static void Prepare(const StripGroup&) {}
  const StripLink* links() const { return context_.model.strip_links.data(); }
  StripLinkSolution<Scalars, Vectors>* solution() const {
    return scratch_.links.Reserve<StripLinkSolution<Scalars, Vectors>>(
        context_.model.longest_strip);
  }
  Vectors* end_directions() const {
    if (!context_.controls.has_start_directions()) return nullptr;
    return scratch_.end_directions.Reserve<Vectors>(context_.model.longest_strip);
  }
  float tolerance() const { return context_.controls.tolerance; }
  Vec8 end_share() const { return Splat8(context_.controls.end_share); }
  float interval() const { return context_.substep.interval; }
  float inverse_interval() const { return context_.substep.inverse_interval; }
  float inverse_force_time() const { return context_.substep.inverse_force_time; }
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

  Vec8 RoundOffs(const Ends& ends) const {
    VectorPairs p, u;
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      p[k] = VectorsAt(ends, k, p_);
      u[k] = VectorsAt(ends, k, u_);
    }
    return QuietRoundOff(Transpose(p), Transpose(u), Splat8(context_.controls.slowest_landing));
  }

  static const Mask8& Running(const Mask8& mask) {
    return mask;
  }

  // Pins are left alone: strips that another thread solves may be reading them.
  HWY_INLINE void Push(const Ends& particles, bool has_pins, const Vectors8& change) const {
    const VectorPairs changes = Transpose(change);
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const uint32_t i = particles[k], j = particles[k + kVec4Size];
      const auto [low, high] = SplitVectors(changes[k]);
      if (!has_pins || IsFree(i)) u_[i] += low;
      if (!has_pins || IsFree(j)) u_[j] += high;
    }
  }

  Vec8 Compliances(const Ends& places) const {
    return GatherPlaces(context_.model.compliances, places);
  }
  Vec8 Impulses(const Ends& places) const {
    return GatherPlaces(context_.scratch.distance_impulses, places);
  }
  void AddImpulses(const Ends& places, const Vec8& impulses) const {
    std::vector<Vec4>& sums = context_.scratch.distance_impulses;
    const Numbers8 numbers = Store(impulses);
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      sums[places[lane] / kVec4Size][places[lane] % kVec4Size] += numbers.values[lane];
    }
  }

 private:
  bool IsFree(uint32_t i) const {
    return i != context_.model.spare_particle() && context_.model.inverse_masses[i] > 0;
  }

  HWY_INLINE static Vectors8 Differences(const Ends& from, const Ends& to, const Vec4* values) {
    VectorPairs d;
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) d[k] = Difference(from, to, k, values);
    return Transpose(d);
  }
  // The differences of strips k and k + 4.
  static Vec8 Difference(const Ends& from, const Ends& to, uint32_t k, const Vec4* values) {
    return VectorsAt(to, k, values) - VectorsAt(from, k, values);
  }
  static Vec8 VectorsAt(const Ends& particles, uint32_t k, const Vec4* values) {
    return JoinVectors(values[particles[k]], values[particles[k + kVec4Size]]);
  }

  // One number of each lane from an array of groups of lanes.
  static Vec8 GatherPlaces(const std::vector<Vec4>& groups, const Ends& places) {
    Numbers8 numbers;
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      numbers.values[lane] = groups[places[lane] / kVec4Size][places[lane] % kVec4Size];
    }
    return Load(numbers);
  }

  const StepContext& context_;
  const Vec4* const p_;
  Vec4* const u_;
  const std::span<const StripGroup> groups_;
  StripScratch& scratch_;
};

// Groups [begin, end) of a phase.
bool SolveGroups(const StepContext& context, size_t begin, size_t end, uint32_t member) {
  bool has_changed = false;
  for (size_t g = begin; g < end; ++g) {
    has_changed |= IsAnyLaneSet(
        SweepStrips(EightStrips(context, g, member),
                    {context.model.has_compliance(), context.controls.has_start_directions(),
                     context.controls.plan.solver.has_quiet_links}));
  }
  return has_changed;
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(SolveGroups);

bool SolveStrips(const StepContext& context) {
  const std::vector<uint32_t>& offsets = context.model.strip_phase_offsets;
  bool has_changed = false;
  for (size_t phase = 0; phase + 1 < offsets.size(); ++phase) {
    has_changed |=
        context.team.AnyOf(offsets[phase], offsets[phase + 1], kStripGrain,
                           [&](size_t begin, size_t end, uint32_t member) {
                             return HWY_DYNAMIC_DISPATCH(SolveGroups)(context, begin, end, member);
                           });
  }
  return has_changed;
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
