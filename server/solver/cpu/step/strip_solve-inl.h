// Stage `solve_strips` over any lanes: eight paths of one cloth side by side, or one path of
// several cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_STEP_STRIP_SOLVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_STEP_STRIP_SOLVE_INL_H_
#undef DRAPE_CPU_STEP_STRIP_SOLVE_INL_H_
#else
#define DRAPE_CPU_STEP_STRIP_SOLVE_INL_H_
#endif

#include <hwy/highway.h>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/solver_constants.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

// One link of a strip under way, of each lane.
template <class Scalars, class Vectors>
struct StripLinkSolution {
  Vectors n;        // the line of the impulse
  Scalars ratio;    // coupling to the next link over the pivot
  Scalars impulse;  // [N s]; during the elimination the right side over the pivot
};

inline constexpr float kMaxMove = static_cast<float>(kMaxStripMove);

// The strip (or strips) being solved. Access is what differs between the paths of the backend:
//   Scalars, Vectors, Mask, Ends (the particle of each lane), Link, Group   types
//   Prepare(group)                                                          before it is swept
//   tolerance, end_share                                                    settings
//   interval, inverse_interval          Substep::link_interval_s
//   inverse_force_time                  of the substep
//   Number(x)                                                               a number of a link
//   InverseMassFrom(link, from), Diagonal(link, from), InverseMassTo(link), MinPivot(link)
//   LooseError(link, from, error)                           0 where both ends are held
//   DiagonalFactor(group)                                   1, or more for spans
//   Running(mask)                                                           lanes that are swept
//   PositionDifferences, VelocityDifferences, PredictedDifferences          from, to -> Vectors
//   RoundOffs(ends)                               quiet_round_offs of the particles: Scalars
//   Push(ends, has_pins, change)      onto u; some ends may be pins, which it does not move
//   kAsks                             whether anybody asks for impulses; then
//   PullAtLink(k, impulse), PullAtFirst(group, impulse)   of pins at the end of link k of links(),
//   at
//                                     the first particle of the group
//   Compliances(k)                                     of the links at place k of links()
//   Impulses, AddImpulses(places)                      accumulated
//   reads_impulses, keeps_impulses                     whether any are there, or are asked for
template <class Access, bool kHasCompliance, bool kHasStarts, bool kHasQuietLinks>
class StripSolve {
 public:
  using Scalars = typename Access::Scalars;
  using Vectors = typename Access::Vectors;
  using Mask = typename Access::Mask;
  using Ends = typename Access::Ends;
  using Link = typename Access::Link;

  StripSolve(const Access& access, const typename Access::Group& group)
      : access_(access),
        group_(group),
        first_(group.first),
        link_begin_(group.link_begin),
        links_(access.links() + group.link_begin),
        link_count_(group.link_end - group.link_begin),
        solution_(access.solution()),
        end_directions_(access.end_directions()),
        limit_scale_(1 /
                     (kMaxMove * access.inverse_interval() * kMaxMove * access.inverse_interval())),
        diagonal_factor_(access.DiagonalFactor(group)),
        largest_ratio_sq_(access.Splat(0)),
        inverse_pivot_(access.Splat(0)) {}

  // The lanes in which the error of any link was larger than the tolerance; others stay as they
  // are.
  Mask Run() {
    const Mask is_active = Eliminate();
    if (!IsAnyLaneSet(is_active)) return is_active;
    Substitute(is_active);
    const Scalars one = access_.Splat(1);
    Scalars share = one;
    if (IsAnyLaneSet(largest_ratio_sq_ > one)) [[unlikely]] {
      share = one / Sqrt(Max(largest_ratio_sq_, one));
      TakeBack(share);
    }
    if constexpr (kHasCompliance) {
      if (access_.keeps_impulses()) Accumulate(share);
    }
    return is_active;
  }

 private:
  // Linearises link after link and eliminates the one before.
  Mask Eliminate() {
    const float inverse_h = access_.inverse_interval();
    const Ends* from = &first_;
    Scalars round_off_from;
    if constexpr (kHasQuietLinks) round_off_from = access_.RoundOffs(first_);
    Mask is_active{};
    for (uint32_t k = 0; k < link_count_; ++k) {
      const Link& link = links_[k];
      Vectors d, start, move;
      if constexpr (kHasStarts || kHasQuietLinks) {
        start = access_.PositionDifferences(*from, link.to);
        move = access_.Splat(access_.interval()) * access_.VelocityDifferences(*from, link.to);
        d = start + move;
      } else {
        d = access_.PredictedDifferences(*from, link.to);
      }
      const Scalars inverse_mass_from = access_.InverseMassFrom(link, *from);
      Scalars diagonal = diagonal_factor_ * access_.Diagonal(link, *from);
      const Ends& link_from = *from;
      from = &link.to;
      const Scalars length = Sqrt(Dot(d, d));
      const Vectors n_end = Directions(d, length);
      const Scalars rest_length = access_.Number(link.rest_length);
      Scalars error;
      if constexpr (kHasQuietLinks) {
        const Scalars round_off_to = access_.RoundOffs(link.to);
        const Scalars round_off = round_off_from + round_off_to;
        error = Select(round_off > access_.Splat(0),
                       QuietError(start, move, d, length, rest_length, round_off),
                       length - rest_length);
        round_off_from = round_off_to;
      } else {
        error = length - rest_length;
      }
      error = access_.LooseError(link, link_from, error);
      ImpulseLines<Vectors, Scalars> lines;
      if constexpr (kHasStarts) {
        lines = BlendDirections(start, n_end, access_.end_share());
        diagonal = diagonal * lines.slope;
      }
      if constexpr (kHasCompliance) {
        const Scalars alpha_over_h =
            access_.Compliances(link_begin_ + k) * access_.inverse_force_time();
        if (access_.reads_impulses()) error = error + alpha_over_h * access_.Impulses(link.places);
        diagonal = diagonal + alpha_over_h * inverse_h;
      }
      is_active |= Abs(error) > rest_length * access_.tolerance();
      EliminateLink(k, kHasStarts ? lines.n : n_end, n_end, error, diagonal, inverse_mass_from);
    }
    solution_[link_count_ - 1].ratio = access_.Splat(0);
    return access_.Running(is_active);
  }

  void EliminateLink(uint32_t k, const Vectors& n, const Vectors& n_end, const Scalars& error,
                     const Scalars& diagonal, const Scalars& inverse_mass_from) {
    Scalars pivot = diagonal, right_side = -(error * access_.inverse_interval());
    if (k > 0) {
      auto& before = solution_[k - 1];
      // How the impulse before changes this error; the matrix is symmetric without directions.
      const Scalars coupling = -(inverse_mass_from * Dot(before.n, n_end));
      Scalars coupling_back = coupling;
      if constexpr (kHasStarts) {
        coupling_back = -(inverse_mass_from * Dot(end_directions_[k - 1], n));
      }
      before.ratio = coupling_back * inverse_pivot_;
      pivot = pivot - coupling * before.ratio;
      right_side = right_side - coupling * before.impulse;
    }
    const Scalars min_pivot = access_.MinPivot(links_[k]) * diagonal;
    inverse_pivot_ = access_.Splat(1) / Max(pivot, min_pivot);
    auto& now = solution_[k];
    now.n.x = n.x;  // one by one: GCC copies the whole through the stack
    now.n.y = n.y;
    now.n.z = n.z;
    now.impulse = right_side * inverse_pivot_;
    if constexpr (kHasStarts) end_directions_[k] = n_end;
  }

  // From the last link back: impulses, and what they do to the particle at the end of each link.
  // Vec4 that are not active get none.
  void Substitute(const Mask& is_active) {
    const Scalars zero = access_.Splat(0);
    Vectors pull_of_next{zero, zero, zero};  // impulse * n of the link behind
    Scalars next_impulse = zero;
    for (uint32_t k = link_count_; k-- > 0;) {
      auto& now = solution_[k];
      const Scalars impulse = now.impulse - now.ratio * next_impulse;
      now.impulse = next_impulse = Select(is_active, impulse, zero);
      const Vectors pull = now.impulse * now.n;
      const Vectors change = access_.InverseMassTo(links_[k]) * (pull - pull_of_next);
      MeasureMove(links_[k], change);
      access_.Push(links_[k].to, links_[k].has_pins, change);
      if constexpr (Access::kAsks) access_.PullAtLink(link_begin_ + k, pull - pull_of_next);
      pull_of_next = pull;
    }
    if constexpr (Access::kAsks) {
      access_.PullAtFirst(group_, Vectors{zero, zero, zero} - pull_of_next);
    }
    const Vectors change = -access_.InverseMassFrom(links_[0], first_) * pull_of_next;
    MeasureMove(links_[0], change);
    access_.Push(first_, true, change);
  }

  void MeasureMove(const Link& link, const Vectors& change) {
    const Scalars scale = access_.Number(link.inverse_rest_length_sq) * limit_scale_;
    largest_ratio_sq_ = Max(Dot(change, change) * scale, largest_ratio_sq_);
  }

  // Leaves `share` of what Substitute has done.
  void TakeBack(const Scalars& share) {
    const Scalars back = share - access_.Splat(1), zero = access_.Splat(0);
    Vectors pull_of_next{zero, zero, zero};
    for (uint32_t k = link_count_; k-- > 0;) {
      const Vectors pull = (back * solution_[k].impulse) * solution_[k].n;
      access_.Push(links_[k].to, links_[k].has_pins,
                   access_.InverseMassTo(links_[k]) * (pull - pull_of_next));
      if constexpr (Access::kAsks) access_.PullAtLink(link_begin_ + k, pull - pull_of_next);
      pull_of_next = pull;
    }
    if constexpr (Access::kAsks) {
      access_.PullAtFirst(group_, Vectors{zero, zero, zero} - pull_of_next);
    }
    access_.Push(first_, true, -access_.InverseMassFrom(links_[0], first_) * pull_of_next);
  }

  void Accumulate(const Scalars& share) {
    for (uint32_t k = 0; k < link_count_; ++k) {
      access_.AddImpulses(links_[k].places, share * solution_[k].impulse);
    }
  }

  const Access& access_;
  const typename Access::Group& group_;
  const Ends first_;
  const uint32_t link_begin_;
  const Link* const links_;
  const uint32_t link_count_;
  StripLinkSolution<Scalars, Vectors>* const solution_;
  Vectors* const end_directions_;
  const float limit_scale_;  // over the square of a change of velocity that moves a link's length
  const Scalars diagonal_factor_;
  Scalars largest_ratio_sq_;
  Scalars inverse_pivot_;  // of the link eliminated last
};

// One sweep over `groups`, phase by phase, with the flags that the cloths need: compliance, start
// directions, quiet links. Returns the lanes in which an error was larger than the tolerance.
template <bool... kFlags, class Access>
typename Access::Mask SweepStrips(const Access& access, const std::array<bool, 3>& flags) {
  if constexpr (sizeof...(kFlags) == 3) {
    typename Access::Mask has_changed{};
    for (const auto& group : access.groups()) {
      access.Prepare(group);
      has_changed |= StripSolve<Access, kFlags...>(access, group).Run();
    }
    return has_changed;
  } else {
    return flags[sizeof...(kFlags)] ? SweepStrips<kFlags..., true>(access, flags)
                                    : SweepStrips<kFlags..., false>(access, flags);
  }
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
