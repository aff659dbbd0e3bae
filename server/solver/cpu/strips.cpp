#include "server/solver/cpu/strips.h"

#include <span>

#include "server/solver/cpu/strip_solve-inl.h"

namespace drape::cpu {
namespace {

// Eight strips of a phase, four and four: what strip_solve-inl.h sweeps over.
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
  StripLinkSolution<Scalars, Vectors>* solution() const { return scratch_.links.data(); }
  Vectors* end_directions() const { return scratch_.end_directions.data(); }
  float tolerance() const { return context_.controls.tolerance; }
  WideLanes end_share() const { return WideSplat(context_.controls.end_share); }
  float interval() const { return context_.substep.interval; }
  float inverse_interval() const { return context_.substep.inverse_interval; }
  static WideLanes Splat(float value) { return WideSplat(value); }
  static const WideLanes& Number(const WideLanes& number) { return number; }

  WideVectors PositionDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, p_);
  }
  WideVectors VelocityDifferences(const Ends& from, const Ends& to) const {
    return Differences(from, to, u_);
  }

  // Of the positions at the end of the substep, with half the shuffles.
  WideVectors PredictedDifferences(const Ends& from, const Ends& to) const {
    std::array<Lanes, kWideCount> d;
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      d[lane] = PredictedDifference(p_[from[lane]], p_[to[lane]], u_[from[lane]], u_[to[lane]],
                                    interval());
    }
    return Transpose(d);
  }

  static const WideMask& Running(const WideMask& mask) { return mask; }

  // Pins are left alone: strips that another thread solves may be reading them.
  HWY_INLINE void Push(const Ends& particles, bool has_pins, const WideVectors& change) const {
    const auto low = Transpose(LaneVectors{change.x.low, change.y.low, change.z.low});
    const auto high = Transpose(LaneVectors{change.x.high, change.y.high, change.z.high});
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
      const uint32_t i = particles[lane], j = particles[lane + kLaneCount];
      if (!has_pins || IsFree(i)) u_[i] += low[lane];
      if (!has_pins || IsFree(j)) u_[j] += high[lane];
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
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      sums[places[lane] / kLaneCount][places[lane] % kLaneCount] += impulses.Get(lane);
    }
  }

 private:
  bool IsFree(uint32_t i) const {
    return i != context_.model.spare_particle() && context_.model.inverse_masses[i] > 0;
  }

  static WideVectors Differences(const Ends& from, const Ends& to, const Lanes* values) {
    std::array<Lanes, kWideCount> d;
    for (uint32_t lane = 0; lane < kWideCount; ++lane)
      d[lane] = values[to[lane]] - values[from[lane]];
    return Transpose(d);
  }

  // One number of each lane from an array of groups of lanes.
  static WideLanes GatherPlaces(const std::vector<Lanes>& groups, const Ends& places) {
    WideLanes values{};
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      values.Set(lane, groups[places[lane] / kLaneCount][places[lane] % kLaneCount]);
    }
    return values;
  }

  const StepContext& context_;
  const Lanes* const p_;
  Lanes* const u_;
  const std::span<const StripGroup> groups_;
  StripScratch& scratch_;
};

bool SolveGroup(const StepContext& context, size_t index, uint32_t member) {
  return IsAnyLaneSet(HWY_NAMESPACE::SweepStrips(EightStrips(context, index, member),
                                                 context.model.has_compliance(),
                                                 context.controls.has_start_directions()));
}

// Groups [begin, end) of a phase.
bool SolveGroups(const StepContext& context, size_t begin, size_t end, uint32_t member) {
  bool has_changed = false;
  for (size_t g = begin; g < end; ++g) {
    has_changed |= SolveGroup(context, g, member);
  }
  return has_changed;
}

}  // namespace

bool SolveStrips(const StepContext& context) {
  const std::vector<uint32_t>& offsets = context.model.strip_phase_offsets;
  bool has_changed = false;
  for (size_t phase = 0; phase + 1 < offsets.size(); ++phase) {
    has_changed |= context.team.AnyOf(offsets[phase], offsets[phase + 1], kStripGrain,
                                      [&](size_t begin, size_t end, uint32_t member) {
                                        return SolveGroups(context, begin, end, member);
                                      });
  }
  return has_changed;
}

}  // namespace drape::cpu
