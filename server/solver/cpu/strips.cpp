#include "server/solver/cpu/strips.h"

#include "server/solver/cpu/constraint_math.h"
#include "server/solver/cpu/wide_lanes.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

constexpr float kMaxMove = static_cast<float>(kMaxStripMove);

// One number of each lane from an array of groups of lanes.
WideLanes GatherPlaces(const std::vector<Lanes>& groups,
                       const std::array<uint32_t, kWideCount>& places) {
  WideLanes values{};
  for (uint32_t lane = 0; lane < kWideCount; ++lane) {
    values.Set(lane, groups[places[lane] / kLaneCount][places[lane] % kLaneCount]);
  }
  return values;
}

// The group of strips that is being solved.
template <bool kHasCompliance, bool kHasStarts>
class StripSolve {
 public:
  StripSolve(const StepContext& context, const StripGroup& group)
      : context_(context),
        group_(group),
        h_(context.substep.interval),
        inverse_h_(context.substep.inverse_interval),
        limit_scale_(1 / (kMaxMove * inverse_h_ * kMaxMove * inverse_h_)),
        p_(context.scratch.state.positions.data()),
        u_(context.scratch.state.velocities.data()),
        solution_(context.scratch.strip_links.data()) {}

  // Whether the error of any link was larger than the tolerance.
  bool Run() {
    const WideMask is_active = Eliminate();
    if (!IsAnyLaneSet(is_active)) return false;
    Substitute(is_active);
    WideLanes share = WideSplat(1);
    if (IsAnyLaneSet(largest_ratio_sq_ > WideSplat(1))) [[unlikely]] {
      share = 1 / Sqrt(Max(largest_ratio_sq_, WideSplat(1)));
      TakeBack(share);
    }
    if constexpr (kHasCompliance) Accumulate(share);
    return true;
  }

 private:
  const StripLink& LinkAt(uint32_t k) const {
    return context_.model.strip_links[group_.link_begin + k];
  }
  uint32_t link_count() const { return group_.link_end - group_.link_begin; }

  // Linearises link after link and eliminates the one before; returns the lanes with an error
  // beyond the tolerance.
  WideMask Eliminate() {
    const float tolerance = context_.controls.tolerance;
    const std::array<uint32_t, kWideCount>* from = &group_.first;
    WideMask is_active{};
    for (uint32_t k = 0; k < link_count(); ++k) {
      const StripLink& link = LinkAt(k);
      WideVectors d, start;
      if constexpr (kHasStarts) {
        start = Differences(*from, link.to, p_);
        d = start + WideSplat(h_) * Differences(*from, link.to, u_);
      } else {
        d = PredictedDifferences(*from, link.to);
      }
      from = &link.to;
      const WideLanes length = Sqrt(Dot(d, d));
      StripLinkSolution& now = solution_[k];
      now.n = Directions(d, length);
      WideLanes diagonal = link.diagonal;
      if constexpr (kHasStarts) {
        now.n_end = now.n;
        const auto lines =
            BlendDirections(start, now.n_end, WideSplat(context_.controls.end_share));
        now.n = lines.n;
        diagonal = diagonal * lines.slope;
      }
      WideLanes error = length - link.rest_length;
      if constexpr (kHasCompliance) {
        const WideLanes alpha_over_h =
            GatherPlaces(context_.model.compliances, link.places) * inverse_h_;
        error =
            error + alpha_over_h * GatherPlaces(context_.scratch.distance_impulses, link.places);
        diagonal = diagonal + alpha_over_h * inverse_h_;
      }
      is_active |= Abs(error) > link.rest_length * tolerance;
      EliminateLink(k, error, diagonal);
    }
    return is_active;
  }

  // Of positions or velocities, from particles `from` to `to`.
  static WideVectors Differences(const std::array<uint32_t, kWideCount>& from,
                                 const std::array<uint32_t, kWideCount>& to, const Lanes* values) {
    std::array<Lanes, kWideCount> d;
    for (uint32_t lane = 0; lane < kWideCount; ++lane)
      d[lane] = values[to[lane]] - values[from[lane]];
    return Transpose(d);
  }

  // The same of the positions at the end of the substep, with half the shuffles.
  WideVectors PredictedDifferences(const std::array<uint32_t, kWideCount>& from,
                                   const std::array<uint32_t, kWideCount>& to) const {
    std::array<Lanes, kWideCount> d;
    for (uint32_t lane = 0; lane < kWideCount; ++lane) {
      d[lane] = PredictedDifference(p_[from[lane]], p_[to[lane]], u_[from[lane]], u_[to[lane]], h_);
    }
    return Transpose(d);
  }

  void EliminateLink(uint32_t k, const WideLanes& error, const WideLanes& diagonal) {
    StripLinkSolution& now = solution_[k];
    WideLanes pivot = diagonal, right_side = -(error * inverse_h_);
    if (k > 0) {
      StripLinkSolution& before = solution_[k - 1];
      // How the impulse before changes this error; the matrix is symmetric without directions.
      const WideVectors& now_end = kHasStarts ? now.n_end : now.n;
      const WideLanes coupling = -(LinkAt(k - 1).inverse_mass_joint * Dot(before.n, now_end));
      WideLanes coupling_back = coupling;
      if constexpr (kHasStarts) {
        coupling_back = -(LinkAt(k - 1).inverse_mass_joint * Dot(before.n_end, now.n));
      }
      before.ratio = coupling_back * before.inverse_pivot;
      pivot = pivot - coupling * before.ratio;
      right_side = right_side - coupling * before.impulse;
    }
    now.inverse_pivot = 1 / Max(pivot, LinkAt(k).min_pivot * diagonal);
    now.impulse = right_side * now.inverse_pivot;
    now.ratio = WideLanes{};
  }

  // From the last link back: impulses, and what they do to the particle at the end of each link.
  // Lanes that are not active get none.
  void Substitute(const WideMask& is_active) {
    WideVectors pull_of_next{};  // impulse * n of the link behind
    WideLanes next_impulse{};
    for (uint32_t k = link_count(); k-- > 0;) {
      const StripLink& link = LinkAt(k);
      StripLinkSolution& now = solution_[k];
      const WideLanes impulse = now.impulse - now.ratio * next_impulse;
      now.impulse = next_impulse = Select(is_active, impulse, WideLanes{});
      const WideVectors pull = now.impulse * now.n;
      const WideVectors change = link.inverse_mass_to * (pull - pull_of_next);
      MeasureMove(link, change);
      Push(link.to, change);
      pull_of_next = pull;
    }
    const WideVectors change = -LinkAt(0).inverse_mass_from * pull_of_next;
    MeasureMove(LinkAt(0), change);
    Push(group_.first, change);
  }

  void MeasureMove(const StripLink& link, const WideVectors& change) {
    const WideLanes ratio_sq = Dot(change, change) * (link.inverse_rest_length_sq * limit_scale_);
    largest_ratio_sq_ = Max(ratio_sq, largest_ratio_sq_);
  }

  void Push(const std::array<uint32_t, kWideCount>& particles, const WideVectors& change) {
    const auto low = Transpose(LaneVectors{change.x.low, change.y.low, change.z.low});
    const auto high = Transpose(LaneVectors{change.x.high, change.y.high, change.z.high});
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
      u_[particles[lane]] += low[lane];
      u_[particles[lane + kLaneCount]] += high[lane];
    }
  }

  // Leaves `share` of what Substitute has done.
  void TakeBack(const WideLanes& share) {
    const WideLanes back = share - WideSplat(1);
    WideVectors pull_of_next{};
    for (uint32_t k = link_count(); k-- > 0;) {
      const WideVectors pull = (back * solution_[k].impulse) * solution_[k].n;
      Push(LinkAt(k).to, LinkAt(k).inverse_mass_to * (pull - pull_of_next));
      pull_of_next = pull;
    }
    Push(group_.first, -LinkAt(0).inverse_mass_from * pull_of_next);
  }

  void Accumulate(const WideLanes& share) {
    std::vector<Lanes>& sums = context_.scratch.distance_impulses;
    for (uint32_t k = 0; k < link_count(); ++k) {
      const WideLanes impulse = share * solution_[k].impulse;
      for (uint32_t lane = 0; lane < kWideCount; ++lane) {
        const uint32_t place = LinkAt(k).places[lane];
        sums[place / kLaneCount][place % kLaneCount] += impulse.Get(lane);
      }
    }
  }

  const StepContext& context_;
  const StripGroup& group_;
  const float h_;
  const float inverse_h_;
  const float limit_scale_;  // 1 / (largest speed per link length)^2 [s^2]
  const Lanes* const p_;
  Lanes* const u_;
  StripLinkSolution* const solution_;
  WideLanes largest_ratio_sq_{};
};

template <bool kHasCompliance, bool kHasStarts>
bool Sweep(const StepContext& context) {
  bool has_changed = false;
  for (const StripGroup& group : context.model.strips) {
    has_changed |= StripSolve<kHasCompliance, kHasStarts>(context, group).Run();
  }
  return has_changed;
}

}  // namespace

bool SolveStrips(const StepContext& context) {
  if (context.controls.has_start_directions()) {
    return context.model.has_compliance() ? Sweep<true, true>(context)
                                          : Sweep<false, true>(context);
  }
  return context.model.has_compliance() ? Sweep<true, false>(context)
                                        : Sweep<false, false>(context);
}

}  // namespace drape::cpu
