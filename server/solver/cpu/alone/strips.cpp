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
  using Scalars = WideLanes;
  using Vectors = WideVectors;
  using Mask = WideMask;
  using Ends = std::array<uint32_t, kWideCount>;
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
  WideLanes end_share() const { return WideSplat(context_.controls.end_share); }
  float interval() const { return context_.substep.interval; }
  float inverse_interval() const { return context_.substep.inverse_interval; }
  static WideLanes Splat(float value) { return WideSplat(value); }
  static WideLanes Number(const StripNumbers& numbers) { return Load(numbers); }

  WideVectors PositionDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, p_);
  }
  WideVectors VelocityDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, u_);
  }

  // Of the positions at the end of the substep, with half the shuffles.
  HWY_INLINE WideVectors PredictedDifferences(const Ends& from, const Ends& to) const {
    const WideLanes interval = WideSplat(this->interval());
    VectorPairs d;
#pragma GCC unroll 4  // so that they stay in registers
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      d[k] = Difference(from, to, k, p_) + interval * Difference(from, to, k, u_);
    }
    return Transpose(d);
  }

  static const WideMask& Running(const WideMask& mask) {
    return mask;
  }

  // Pins are left alone: strips that another thread solves may be reading them.
  HWY_INLINE void Push(const Ends& particles, bool has_pins, const WideVectors& change) const {
    const VectorPairs changes = Transpose(change);
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      const uint32_t i = particles[k], j = particles[k + kLaneCount];
      const auto [low, high] = SplitVectors(changes[k]);
      if (!has_pins || IsFree(i)) u_[i] += low;
      if (!has_pins || IsFree(j)) u_[j] += high;
    }
  }

  WideLanes Compliances(const Ends& places) const {
    return GatherPlaces(context_.model.compliances, places);
  }
  WideLanes Impulses(const Ends& places) const {
    return GatherPlaces(context_.scratch.distance_impulses, places);
  }
  void AddImpulses(const Ends& places, const WideLanes& impulses) const {
    std::vector<Lanes>& sums = context_.scratch.distance_impulses;
    const StripNumbers numbers = Store(impulses);
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      sums[places[lane] / kLaneCount][places[lane] % kLaneCount] += numbers.values[lane];
    }
  }

 private:
  bool IsFree(uint32_t i) const {
    return i != context_.model.spare_particle() && context_.model.inverse_masses[i] > 0;
  }

  static WideVectors Differences(const Ends& from, const Ends& to, const Lanes* values) {
    VectorPairs d;
    for (uint32_t k = 0; k < kLaneCount; ++k) d[k] = Difference(from, to, k, values);
    return Transpose(d);
  }
  // Of strips k and k + 4.
  static WideLanes Difference(const Ends& from, const Ends& to, uint32_t k, const Lanes* values) {
    return VectorsAt(to, k, values) - VectorsAt(from, k, values);
  }
  static WideLanes VectorsAt(const Ends& particles, uint32_t k, const Lanes* values) {
    return JoinVectors(values[particles[k]], values[particles[k + kLaneCount]]);
  }

  // One number of each lane from an array of groups of lanes.
  static WideLanes GatherPlaces(const std::vector<Lanes>& groups, const Ends& places) {
    StripNumbers numbers;
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      numbers.values[lane] = groups[places[lane] / kLaneCount][places[lane] % kLaneCount];
    }
    return Load(numbers);
  }

  const StepContext& context_;
  const Lanes* const p_;
  Lanes* const u_;
  const std::span<const StripGroup> groups_;
  StripScratch& scratch_;
};

// Groups [begin, end) of a phase.
bool SolveGroups(const StepContext& context, size_t begin, size_t end, uint32_t member) {
  bool has_changed = false;
  for (size_t g = begin; g < end; ++g) {
    has_changed |=
        IsAnyLaneSet(SweepStrips(EightStrips(context, g, member), context.model.has_compliance(),
                                 context.controls.has_start_directions()));
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
