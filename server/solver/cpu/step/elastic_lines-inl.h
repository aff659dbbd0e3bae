// Stage `solve_elastic` over any lanes: eight lines of elements of one cloth side by side, or one
// line of several cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_STEP_ELASTIC_LINES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_STEP_ELASTIC_LINES_INL_H_
#undef DRAPE_CPU_STEP_ELASTIC_LINES_INL_H_
#else
#define DRAPE_CPU_STEP_ELASTIC_LINES_INL_H_
#endif

#include <hwy/highway.h>

#include <span>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/step/strip_solve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

// The lines (or several side by side) being solved. Access is what differs between the paths of the
// backend, as in strip_solve-inl.h, with
//   Place                           type: ElasticPlace
//   force_time                      of the substep
//   solution()                      memory for the longest line; what it holds is up to each kind
//   SetCellImpulses(ends, y)        of the cells whose first particles are the ends
//   kAsks                           whether anybody asks for impulses; then
//   Pull(ends, has_pins, impulse)   of held particles; right_sides(): memory for the longest line
//   largest_force_interval          SubstepSchedule::largest_force_interval_s2
template <class Access>
class ElasticSolve {
 public:
  using Scalars = typename Access::Scalars;
  using Vectors = typename Access::Vectors;
  using Ends = typename Access::Ends;
  using Place = typename Access::Place;

  ElasticSolve(const Access& access, std::span<const Place> places)
      : access_(access),
        places_(places),
        solution_(access.solution()),
        right_sides_(Access::kAsks ? access.right_sides() : nullptr) {}

  void Rods() {
    const Scalars force_time = access_.Splat(access_.force_time());
    // The rods act between neighbours: between particle k and the next by the moment (over the
    // spacing) at k, less that at the next.
    Vectors ahead = access_.PredictedDifferences(places_[0].particles, places_[1].particles);
    Vectors moment = Zero(), before = Zero();
    Vectors one_before = Zero(), two_before = Zero();  // solution at the last two particles
    for (size_t k = 0; k < places_.size(); ++k) {
      Vectors impulse = moment;
      if (k + 2 < places_.size()) {
        const Vectors link = ahead;
        ahead = access_.PredictedDifferences(places_[k + 1].particles, places_[k + 2].particles);
        moment = access_.Number(places_[k + 1].elasticity) * (ahead - link);
      } else {
        moment = Zero();
      }
      impulse = impulse - moment;
      Vectors x = force_time * (impulse - before);
      if (k > 0) x = x - access_.Number(places_[k - 1].to_next) * one_before;
      if (k > 1) x = x - access_.Number(places_[k - 2].to_second_next) * two_before;
      if constexpr (Access::kAsks) KeepIn(right_sides_[k], force_time * (impulse - before));
      before = impulse;
      two_before = one_before;
      one_before = x;
      Keep(k, x);
    }
    Vectors next = Zero(), second_next = Zero();
    for (size_t k = places_.size(); k-- > 0;) {
      const Place& place = places_[k];
      const Vectors x = (access_.Number(place.inverse_pivot) * solution_[k].n -
                         access_.Number(place.to_next) * next) -
                        access_.Number(place.to_second_next) * second_next;
      access_.Push(place.particles, place.has_pins, x);
      if constexpr (Access::kAsks) Keep(k, x);
      second_next = next;
      next = x;
    }
    if constexpr (Access::kAsks) PullByRods();
  }

  // As a strip of compliant links, whose pivots the compliances keep apart from 0.
  void Diagonals(float rest_length) {
    const float inverse_h = access_.inverse_interval();
    const Scalars inverse_s = access_.Splat(access_.inverse_force_time() * inverse_h);
    const size_t count = places_.size() - 1;
    Vectors n_before = Zero();
    Scalars inverse_pivot = access_.Splat(0), impulse = access_.Splat(0);
    for (size_t k = 0; k < count; ++k) {
      const Vectors d =
          access_.PredictedDifferences(places_[k].particles, places_[k + 1].particles);
      const Scalars length = Sqrt(Dot(d, d));
      const Vectors n = Directions(d, length);
      const Scalars w = access_.Number(places_[k].inverse_mass);
      Scalars pivot = (w + access_.Number(places_[k + 1].inverse_mass)) +
                      access_.Number(places_[k].elasticity) * inverse_s;
      Scalars right_side = -((length - access_.Splat(rest_length)) * inverse_h);
      if (k > 0) {
        const Scalars coupling = -(w * Dot(n_before, n));
        const Scalars ratio = coupling * inverse_pivot;
        solution_[k - 1].ratio = ratio;
        pivot = pivot - coupling * ratio;
        right_side = right_side - coupling * impulse;
      }
      inverse_pivot = access_.Splat(1) / pivot;
      impulse = right_side * inverse_pivot;
      n_before = n;
      Keep(k, n);
      solution_[k].impulse = impulse;
    }
    solution_[count - 1].ratio = access_.Splat(0);
    Vectors pull_of_next = Zero();  // impulse * n of the link behind
    impulse = access_.Splat(0);
    for (size_t k = count; k-- > 0;) {
      const auto& now = solution_[k];
      impulse = now.impulse - now.ratio * impulse;
      const Vectors pull = impulse * now.n;
      Push(places_[k + 1], pull - pull_of_next);
      Pull(places_[k + 1], pull - pull_of_next);
      pull_of_next = pull;
    }
    Push(places_[0], Zero() - pull_of_next);
    Pull(places_[0], Zero() - pull_of_next);
  }

  // Finds the impulses of rows of cells, and changes no velocity.
  void Cells(uint32_t columns) {
    const Scalars force_time = access_.Splat(access_.force_time());
    const size_t count = places_.size() - 1;
    Vectors rung = Rung(0, columns), before = Zero();
    for (size_t k = 0; k < count; ++k) {
      const Vectors next_rung = Rung(k + 1, columns);
      Vectors y = force_time * (rung - next_rung);
      if (k > 0) y = y - access_.Number(places_[k - 1].to_next) * before;
      rung = next_rung;
      before = y;
      Keep(k, y);
    }
    Vectors next = Zero();
    for (size_t k = count; k-- > 0;) {
      next = access_.Number(places_[k].inverse_pivot) * solution_[k].n -
             access_.Number(places_[k].to_next) * next;
      access_.SetCellImpulses(places_[k].particles, next);
    }
  }

 private:
  Vectors Zero() const {
    const Scalars zero = access_.Splat(0);
    return {zero, zero, zero};
  }

  // Between the particles at place k of the two rows of the cells.
  Vectors Rung(size_t k, uint32_t columns) const {
    Ends below = places_[k].particles;
    for (uint32_t& i : below) i += columns;
    return access_.PredictedDifferences(places_[k].particles, below);
  }

  void Keep(size_t k, const Vectors& v) { KeepIn(solution_[k].n, v); }
  static void KeepIn(Vectors& place, const Vectors& v) {
    place.x = v.x;  // one by one: GCC copies the whole through the stack
    place.y = v.y;
    place.z = v.z;
  }

  // With the changes of velocity x in solution_: the rows of the right side - s K x.
  void PullByRods() const {
    const auto count = static_cast<int>(places_.size());
    const Scalars s = access_.Splat(access_.largest_force_interval());
    // The moments by x at the rod in the middle of three particles; none at the ends.
    const auto moment = [&](int k) {
      if (k < 1 || k + 1 >= count) return Zero();
      const Vectors bend =
          (solution_[k + 1].n - solution_[k].n) - (solution_[k].n - solution_[k - 1].n);
      return s * access_.Number(places_[static_cast<size_t>(k)].elasticity) * bend;
    };
    for (int k = 0; k < count; ++k) {
      const Vectors middle = moment(k);
      const Vectors row = (moment(k - 1) - middle) + (moment(k + 1) - middle);
      Pull(places_[static_cast<size_t>(k)], right_sides_[k] - row);
    }
  }

  void Pull(const Place& place, const Vectors& impulse) const {
    if constexpr (Access::kAsks) access_.Pull(place.particles, place.has_pins, impulse);
  }

  void Push(const Place& place, const Vectors& pull) const {
    access_.Push(place.particles, place.has_pins, access_.Number(place.inverse_mass) * pull);
  }

  const Access& access_;
  const std::span<const Place> places_;
  StripLinkSolution<Scalars, Vectors>* const solution_;
  Vectors* const right_sides_;  // of rods [N s]; only where pulls are asked for
};

// Solves the lines of one group.
template <class Access>
void SolveElasticGroup(const Access& access, const SceneModel& model, const ElasticFamily& family,
                       std::span<const typename Access::Place> places) {
  ElasticSolve<Access> solve(access, places);
  switch (family.kind) {
    case ElasticKind::kRods:
      return solve.Rods();
    case ElasticKind::kDiagonals:
      return solve.Diagonals(static_cast<float>(family.rest_length_m));
    case ElasticKind::kCells:
      return solve.Cells(model.grid_columns());
  }
}

// Applies the impulses of the cells above and below a row of particles.
//   impulse(i)    of the cell that begins at particle i, of each cloth
//   push(i, x)    gives particle i this impulse
template <class Vectors, class Impulse, class Push>
HWY_INLINE void ApplyCells(const FloatModel& model, uint32_t row, const Vectors& zero,
                           const Impulse& impulse, const Push& push) {
  const uint32_t columns = model.source->grid_columns();
  const bool is_below = row + 1 < model.source->grid_rows();
  Vectors before = zero;  // of the cells before a particle
  for (uint32_t column = 0; column < columns; ++column) {
    const uint32_t i = row * columns + column;
    Vectors here = zero;
    if (column + 1 < columns) {
      if (is_below) here = impulse(i);
      if (row > 0) here = here - impulse(i - columns);
    }
    push(i, here - before);
    before = here;
  }
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
