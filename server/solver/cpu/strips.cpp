#include "server/solver/cpu/strips.h"

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

  explicit EightStrips(const StepContext& context)
      : context_(context),
        p_(context.scratch.state.positions.data()),
        u_(context.scratch.state.velocities.data()) {}

  const std::vector<StripGroup>& groups() const { return context_.model.strips; }
  static void Prepare(const StripGroup&) {}
  const StripLink* links() const { return context_.model.strip_links.data(); }
  StripLinkSolution<Scalars, Vectors>* solution() const {
    return context_.scratch.strip_links.data();
  }
  Vectors* end_directions() const { return context_.scratch.end_directions.data(); }
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

  void Push(const Ends& particles, const WideVectors& change) const {
    const auto low = Transpose(LaneVectors{change.x.low, change.y.low, change.z.low});
    const auto high = Transpose(LaneVectors{change.x.high, change.y.high, change.z.high});
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
      u_[particles[lane]] += low[lane];
      u_[particles[lane + kLaneCount]] += high[lane];
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
};

}  // namespace

bool SolveStrips(const StepContext& context) {
  return IsAnyLaneSet(HWY_NAMESPACE::SweepStrips(EightStrips(context),
                                                 context.model.has_compliance(),
                                                 context.controls.has_start_directions()));
}

}  // namespace drape::cpu
