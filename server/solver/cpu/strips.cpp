#include "server/solver/cpu/strips.h"

#include "server/solver/cpu/constraint_math.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

constexpr float kMinPivot = static_cast<float>(kMinStripPivot);
constexpr float kMaxMove = static_cast<float>(kMaxStripMove);

Lanes DotOf(const LaneVectors& a, const LaneVectors& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

// One number of each lane from an array of groups of lanes.
Lanes GatherPlaces(const std::vector<Lanes>& groups,
                   const std::array<uint32_t, kLaneCount>& places) {
  Lanes values{};
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
    values[lane] = groups[places[lane] / kLaneCount][places[lane] % kLaneCount];
  }
  return values;
}

// The group of strips that is being solved.
template <bool kHasCompliance>
class StripSolve {
 public:
  StripSolve(const StepContext& context, const StripGroup& group)
      : context_(context),
        group_(group),
        h_(context.substep.interval),
        inverse_h_(context.substep.inverse_interval),
        u_(context.scratch.state.velocities.data()),
        solution_(context.scratch.strip_links.data()) {}

  // Whether the error of any link was larger than the tolerance.
  bool Run() {
    const LaneMask is_active = Eliminate();
    if (!IsAnyLaneSet(is_active)) return false;
    Substitute(is_active);
    const Lanes step = StepLengths();
    if (IsAnyLaneSet(step < 1)) [[unlikely]]
      ShortenStep(step);
    if constexpr (kHasCompliance) Accumulate(step);
    return true;
  }

 private:
  const StripLink& LinkAt(uint32_t k) const {
    return context_.model.strip_links[group_.link_begin + k];
  }
  uint32_t link_count() const { return group_.link_end - group_.link_begin; }

  // Linearises link after link and eliminates the one before; returns the lanes with an error
  // beyond the tolerance.
  LaneMask Eliminate() {
    const Lanes* const p = context_.scratch.state.positions.data();
    const float tolerance = context_.controls.tolerance;
    std::array<uint32_t, kLaneCount> from = group_.first;
    LaneMask is_active{};
    for (uint32_t k = 0; k < link_count(); ++k) {
      const StripLink& link = LinkAt(k);
      Lanes d[kLaneCount];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const uint32_t i = from[lane], j = link.to[lane];
        d[lane] = PredictedDifference(p[i], p[j], u_[i], u_[j], h_);
      }
      from = link.to;
      LaneVectors n = Transpose(d[0], d[1], d[2], d[3]);
      const Lanes length = Sqrt(DotOf(n, n));
      const LaneMask is_short = length < kMinDirectionLength;
      const Lanes inverse_length = 1 / (is_short ? Splat(1) : length);
      n = {is_short ? Splat(1) : n.x * inverse_length, is_short ? Splat(0) : n.y * inverse_length,
           is_short ? Splat(0) : n.z * inverse_length};
      Lanes error = length - link.rest_length;
      Lanes diagonal = link.diagonal;
      if constexpr (kHasCompliance) {
        const Lanes alpha_over_h =
            GatherPlaces(context_.model.compliances, link.places) * inverse_h_;
        error += alpha_over_h * GatherPlaces(context_.scratch.distance_impulses, link.places);
        diagonal += alpha_over_h * inverse_h_;
      }
      is_active |= Abs(error) > tolerance * link.rest_length;

      StripLinkSolution& now = solution_[k];
      now.n = n;
      Lanes pivot = diagonal, right_side = -error * inverse_h_;
      if (k > 0) {
        StripLinkSolution& before = solution_[k - 1];
        before.coupling = -LinkAt(k - 1).inverse_mass_joint * DotOf(before.n, n);
        pivot -= before.coupling * (before.coupling * before.inverse_pivot);
        right_side -= before.coupling * before.impulse;
      }
      const Lanes least = kMinPivot * diagonal;
      now.inverse_pivot = 1 / (pivot > least ? pivot : least);
      now.impulse = right_side * now.inverse_pivot;
      now.coupling = Lanes{};
    }
    return is_active;
  }

  // From the last link back: impulses, and what they do to the particle at the end of each link.
  // Lanes that are not active get none.
  void Substitute(LaneMask is_active) {
    LaneVectors pull_of_next{};  // impulse * n of the link behind
    Lanes next_impulse{};
    for (uint32_t k = link_count(); k-- > 0;) {
      StripLinkSolution& now = solution_[k];
      const Lanes impulse = now.impulse - now.coupling * now.inverse_pivot * next_impulse;
      now.impulse = is_active ? impulse : Lanes{};
      next_impulse = now.impulse;
      const LaneVectors pull{now.impulse * now.n.x, now.impulse * now.n.y, now.impulse * now.n.z};
      Push(LinkAt(k).to, LinkAt(k).inverse_mass_to, pull, pull_of_next, LinkAt(k).rest_length,
           true);
      pull_of_next = pull;
    }
    Push(group_.first, LinkAt(0).inverse_mass_from, LaneVectors{}, pull_of_next,
         LinkAt(0).rest_length, true);
  }

  // u += w (pull - pull_of_next), for the particles between two links.
  void Push(const std::array<uint32_t, kLaneCount>& particles, Lanes inverse_mass,
            const LaneVectors& pull, const LaneVectors& pull_of_next, Lanes rest_length,
            bool is_measured) {
    const LaneVectors change{inverse_mass * (pull.x - pull_of_next.x),
                             inverse_mass * (pull.y - pull_of_next.y),
                             inverse_mass * (pull.z - pull_of_next.z)};
    if (is_measured) {
      const Lanes speed_sq = DotOf(change, change);
      const Lanes limit = rest_length * (kMaxMove * inverse_h_);
      const Lanes ratio_sq = speed_sq / (limit * limit);
      const LaneMask is_real = inverse_mass > 0;
      const LaneMask is_larger = is_real & (ratio_sq > largest_ratio_sq_);
      largest_ratio_sq_ = is_larger ? ratio_sq : largest_ratio_sq_;
    }
    const std::array<Lanes, kLaneCount> changes = Transpose(change);
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) u_[particles[lane]] += changes[lane];
  }

  // The share of the impulses that moves no particle by more than kMaxStripMove link lengths.
  Lanes StepLengths() const {
    return largest_ratio_sq_ > 1 ? 1 / Sqrt(largest_ratio_sq_) : Splat(1);
  }

  // Takes back what is beyond the share.
  void ShortenStep(Lanes step) {
    const Lanes back = step - 1;
    LaneVectors pull_of_next{};
    for (uint32_t k = link_count(); k-- > 0;) {
      const StripLinkSolution& now = solution_[k];
      const Lanes impulse = back * now.impulse;
      const LaneVectors pull{impulse * now.n.x, impulse * now.n.y, impulse * now.n.z};
      Push(LinkAt(k).to, LinkAt(k).inverse_mass_to, pull, pull_of_next, Splat(1), false);
      pull_of_next = pull;
    }
    Push(group_.first, LinkAt(0).inverse_mass_from, LaneVectors{}, pull_of_next, Splat(1), false);
  }

  void Accumulate(Lanes step) {
    std::vector<Lanes>& sums = context_.scratch.distance_impulses;
    for (uint32_t k = 0; k < link_count(); ++k) {
      const Lanes impulse = step * solution_[k].impulse;
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const uint32_t place = LinkAt(k).places[lane];
        sums[place / kLaneCount][place % kLaneCount] += impulse[lane];
      }
    }
  }

  const StepContext& context_;
  const StripGroup& group_;
  const float h_;
  const float inverse_h_;
  Lanes* const u_;
  StripLinkSolution* const solution_;
  Lanes largest_ratio_sq_{};
};

template <bool kHasCompliance>
bool Sweep(const StepContext& context) {
  bool has_changed = false;
  for (const StripGroup& group : context.model.strips) {
    has_changed |= StripSolve<kHasCompliance>(context, group).Run();
  }
  return has_changed;
}

}  // namespace

bool SolveStrips(const StepContext& context) {
  return context.model.has_compliance() ? Sweep<true>(context) : Sweep<false>(context);
}

}  // namespace drape::cpu
