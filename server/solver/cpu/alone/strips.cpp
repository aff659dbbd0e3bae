#include "server/solver/cpu/alone/strips.h"

#include <span>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/strips.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/alone/eight_paths-inl.h"
#include "server/solver/cpu/step/strip_solve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Eight strips of a phase: what strip_solve-inl.h sweeps over.
template <bool kHasGrips, bool kAsksForImpulses>
class EightStrips : public EightPaths {
 public:
  static constexpr bool kAsks = kAsksForImpulses;
  using Mask = Mask8;
  using Link = StripLink;
  using Group = StripGroup;

  // Group `index` of the model, by a member of the team.
  EightStrips(const StepContext& context, size_t index, uint32_t member)
      : EightPaths(context, context.substep.link_interval, context.substep.inverse_link_interval),
        groups_(&context.model.strips[index], 1),
        scratch_(context.scratch.strips[member]) {}

  std::span<const StripGroup> groups() const { return groups_; }
  static void Prepare(const StripGroup&) {}
  const StripLink* links() const { return context().model.strip_links.data(); }
  StripLinkSolution<Scalars, Vectors>* solution() const {
    return scratch_.links.Reserve<StripLinkSolution<Scalars, Vectors>>(
        context().model.longest_strip);
  }
  Vectors* end_directions() const {
    if (!context().controls.has_start_directions()) return nullptr;
    return scratch_.end_directions.Reserve<Vectors>(context().model.longest_strip);
  }
  float tolerance() const { return context().controls.tolerance; }
  Vec8 end_share() const { return Splat8(context().controls.end_share); }

  Vec8 InverseMassFrom(const StripLink& link, const Ends& from) const {
    if constexpr (kHasGrips) return InverseMasses(link, from);
    return Number(link.inverse_mass_from);
  }
  Vec8 InverseMassTo(const StripLink& link) const {
    if constexpr (kHasGrips) return InverseMasses(link, link.to);
    return Number(link.inverse_mass_to);
  }
  Vec8 Diagonal(const StripLink& link, const Ends& from) const {
    if constexpr (kHasGrips) {
      const Vec8 sum = InverseMasses(link, from) + InverseMasses(link, link.to);
      return Select(sum > Splat(0), sum, Splat(1));
    }
    return Number(link.diagonal);
  }
  Vec8 DiagonalFactor(const StripGroup& group) const {
    return Splat(1) + Splat(context().controls.span_give) * Number(group.span);
  }
  Vec8 MinPivot(const StripLink& link) const {
    if constexpr (kHasGrips) {
      return Select(InverseMasses(link, link.to) > Splat(0),
                    Splat(static_cast<float>(kMinStripPivot)),
                    Splat(static_cast<float>(kMinStripPivotAtPin)));
    }
    return Number(link.min_pivot);
  }
  // The error of a link that nothing moves is none.
  Vec8 LooseError(const StripLink& link, const Ends& from, const Vec8& error) const {
    if constexpr (kHasGrips) {
      const Vec8 sum = InverseMasses(link, from) + InverseMasses(link, link.to);
      return Select(sum > Splat(0), error, Splat(0));
    }
    return error;
  }

  Vec8 RoundOffs(const Ends& particles) const {
    const std::vector<float>& round_offs = context().scratch.quiet_round_offs;
    Numbers8 numbers;
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      numbers.values[lane] = round_offs[particles[lane]];
    }
    return Load(numbers);
  }
  static const Mask8& Running(const Mask8& mask) { return mask; }

  HWY_INLINE void PullAtLink(uint32_t link, const Vectors8& impulses) const {
    if (!links()[link].has_pins && !context().held.has_grips) return;
    ForHeld(links()[link].to, impulses, [&](uint32_t lane, Vec4 impulse) {
      context().impulses()->PullAtLink(link, lane, impulse);
    });
  }
  HWY_INLINE void PullAtFirst(const StripGroup& group, const Vectors8& impulses) const {
    const auto index = static_cast<size_t>(&group - context().model.strips.data());
    ForHeld(group.first, impulses, [&](uint32_t lane, Vec4 impulse) {
      context().impulses()->PullAtFirst(index, lane, impulse);
    });
  }

  Vec8 Compliances(uint32_t link) const { return Number(context().model.strip_compliances[link]); }
  bool reads_impulses() const { return context().SolvesLinksAgain(); }
  bool keeps_impulses() const { return context().KeepsImpulses(); }
  Vec8 Impulses(const Ends& places) const {
    return GatherPlaces(context().scratch.distance_impulses, places);
  }
  void AddImpulses(const Ends& places, const Vec8& impulses) const {
    std::vector<Vec4>& sums = context().scratch.distance_impulses;
    const Numbers8 numbers = Store(impulses);
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      sums[places[lane] / kVec4Size][places[lane] % kVec4Size] += numbers.values[lane];
    }
  }

 private:
  // Of the particles at one end of a link, 0 where it is padding.
  Vec8 InverseMasses(const StripLink& link, const Ends& ends) const {
    Numbers8 numbers;
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      const bool is_padding = link.rest_length.values[lane] == 0;
      numbers.values[lane] = is_padding ? 0 : context().held.inverse_masses[ends[lane]];
    }
    return Load(numbers);
  }
  // One number of each lane from an array of groups of lanes.
  static Vec8 GatherPlaces(const std::vector<Vec4>& groups, const Ends& places) {
    Numbers8 numbers;
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) {
      numbers.values[lane] = groups[places[lane] / kVec4Size][places[lane] % kVec4Size];
    }
    return Load(numbers);
  }

  const std::span<const StripGroup> groups_;
  StripScratch& scratch_;
};

// Groups [begin, end) of a phase.
template <bool kHasGrips, bool kAsks>
bool SolveGroupsOf(const StepContext& context, size_t begin, size_t end, uint32_t member) {
  bool has_changed = false;
  for (size_t g = begin; g < end; ++g) {
    has_changed |= IsAnyLaneSet(
        SweepStrips(EightStrips<kHasGrips, kAsks>(context, g, member),
                    {context.model.has_compliance(), context.controls.has_start_directions(),
                     context.scratch.has_quiet_particles}));
  }
  return has_changed;
}

bool SolveGroups(const StepContext& context, size_t begin, size_t end, uint32_t member) {
  if (context.impulses() != nullptr) {
    return context.held.has_grips ? SolveGroupsOf<true, true>(context, begin, end, member)
                                  : SolveGroupsOf<false, true>(context, begin, end, member);
  }
  return context.held.has_grips ? SolveGroupsOf<true, false>(context, begin, end, member)
                                : SolveGroupsOf<false, false>(context, begin, end, member);
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
