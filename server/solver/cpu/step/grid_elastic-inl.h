// Stage `apply_elastic` of grids, row by row, over any lanes: eight columns of one cloth side by
// side, or one particle of several cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_STEP_GRID_ELASTIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_STEP_GRID_ELASTIC_INL_H_
#undef DRAPE_CPU_STEP_GRID_ELASTIC_INL_H_
#else
#define DRAPE_CPU_STEP_GRID_ELASTIC_INL_H_
#endif

#include <hwy/highway.h>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/model/grid_elements.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

// The kick on rows of particles. Access is what differs between the paths of the backend:
//   Scalars, Vectors                types
//   kStep                           columns in a vector
//   Begin(row)                      before a row of particles is read, row after row
//   Positions, Velocities(row)      of the particles: at(column), also one column outside; of the
//                                   last kKeptPositions rows that were begun
//   Stiffnesses, Dampings(family, row)   of the elements: at(column); 0 outside the grid
//   Forces(family, row)             memory of the row KeptRow: at(column), also one column outside,
//                                   Set(column, f)
//   WhereEven(row, column, a, b)    a where the sum of row and column is even, else b
//   Push(row, column, f)            gives the particles there the impulse f times the duration of
//                                   the kick
template <class Access>
class GridElastic {
 public:
  using Scalars = typename Access::Scalars;
  using Vectors = typename Access::Vectors;

  GridElastic(Access& access, const GridElements& grid, float rest_length)
      : access_(access),
        grid_(grid),
        columns_(static_cast<int>(grid.columns)),
        rest_length_(access.Splat(rest_length)) {}

  // Rows [begin, end) of particles. Reads positions and velocities of the two rows before and after
  // those, whose elements it finds again.
  void Run(uint32_t begin, uint32_t end) {
    if (begin > 1) Begin(begin - 2);
    if (begin > 0) Begin(begin - 1);
    Begin(begin);
    if (begin > 0) FindForces(begin - 1);
    Begin(begin + 1);
    FindForces(begin);
    for (uint32_t row = begin; row < end; ++row) {
      Begin(row + 2);
      FindRodsAlongColumns(row + 1);
      PushRow(row);
      if (row + 1 < end) FindForcesAlongRows(row + 1);
    }
  }

 private:
  static constexpr int kStep = Access::kStep;

  void Begin(uint32_t row) {
    if (row < grid_.rows) access_.Begin(row);
  }

  void FindForces(uint32_t row) {
    FindRodsAlongColumns(row);
    FindForcesAlongRows(row);
  }

  // k L of the rods whose middles are in this row.
  void FindRodsAlongColumns(uint32_t row) {
    if (!grid_.has_bending || row == 0 || row + 1 >= grid_.rows) return;
    const auto before = access_.Positions(row - 1), here = access_.Positions(row);
    const auto after = access_.Positions(row + 1);
    const auto stiffness = access_.Stiffnesses(GridFamily::kRodsAlongColumns, row);
    const auto force = access_.Forces(GridFamily::kRodsAlongColumns, row);
    for (int c = 0; c < columns_; c += kStep) {
      const Vectors middle = here.at(c);
      force.Set(c, stiffness.at(c) * ((before.at(c) - middle) + (after.at(c) - middle)));
    }
  }

  // Of all others that begin in this row.
  void FindForcesAlongRows(uint32_t row) {
    if (grid_.has_bending) FindRodsAlongRows(row);
    if (row + 1 >= grid_.rows) return;
    if (grid_.has_bending) FindCells(row);
    if (grid_.has_shear) FindDiagonals(row);
  }

  void FindRodsAlongRows(uint32_t row) {
    const auto here = access_.Positions(row);
    const auto stiffness = access_.Stiffnesses(GridFamily::kRodsAlongRows, row);
    const auto force = access_.Forces(GridFamily::kRodsAlongRows, row);
    for (int c = 0; c < columns_; c += kStep) {
      const Vectors middle = here.at(c);
      force.Set(c, stiffness.at(c) * ((here.at(c - 1) - middle) + (here.at(c + 1) - middle)));
    }
  }

  void FindCells(uint32_t row) {
    const auto here = access_.Positions(row), after = access_.Positions(row + 1);
    const auto stiffness = access_.Stiffnesses(GridFamily::kCells, row);
    const auto force = access_.Forces(GridFamily::kCells, row);
    for (int c = 0; c < columns_; c += kStep) {
      force.Set(
          c, stiffness.at(c) * ((here.at(c) - here.at(c + 1)) - (after.at(c) - after.at(c + 1))));
    }
  }

  // Along L, from a row to the next one.
  void FindDiagonals(uint32_t row) {
    const auto here = access_.Positions(row), after = access_.Positions(row + 1);
    const auto u_here = access_.Velocities(row), u_after = access_.Velocities(row + 1);
    const auto stiffness = access_.Stiffnesses(GridFamily::kDiagonals, row);
    const auto damping = access_.Dampings(GridFamily::kDiagonals, row);
    const auto force = access_.Forces(GridFamily::kDiagonals, row);
    const Scalars zero = access_.Splat(0), one = access_.Splat(1);
    for (int c = 0; c < columns_; c += kStep) {
      const auto along = [&](const auto& from, const auto& to) __attribute__((always_inline)) {
        return access_.WhereEven(row, c, to.at(c + 1), to.at(c)) -
               access_.WhereEven(row, c, from.at(c), from.at(c + 1));
      };
      const Vectors l = along(here, after);
      const Vectors speed = along(u_here, u_after);
      const Scalars length = Sqrt(Dot(l, l));
      const auto is_short = length < access_.Splat(kMinDirectionLength);
      const Scalars inverse_length = one / Select(is_short, one, length);
      const Scalars tension = stiffness.at(c) * (length - rest_length_) +
                              (damping.at(c) * Dot(speed, l)) * inverse_length;
      force.Set(c, Select(is_short, zero, tension * inverse_length) * l);
    }
  }

  void PushRow(uint32_t row) {
    const Scalars zero = access_.Splat(0);
    if (!grid_.has_shear) return PushBending(row, [&](int, const Vectors& sum) { return sum; });
    const bool has_before = row > 0, has_after = row + 1 < grid_.rows;
    const auto diagonals = access_.Forces(GridFamily::kDiagonals, row);
    const auto diagonals_before = access_.Forces(GridFamily::kDiagonals, row + 1);  // of two rows
    // They join the particles of even row + column.
    const auto with_shear = [&](int c, const Vectors& sum) __attribute__((always_inline)) {
      Vectors all = sum;
      if (has_after) all = all + (diagonals.at(c) + diagonals.at(c - 1));
      if (has_before) all = all - (diagonals_before.at(c - 1) + diagonals_before.at(c));
      return access_.WhereEven(row, c, all, sum);
    };
    if (grid_.has_bending) return PushBending(row, with_shear);
    for (int c = 0; c < columns_; c += kStep) {
      access_.Push(row, c, with_shear(c, Vectors{zero, zero, zero}));
    }
  }

  // with_others(column, f): f and the other forces there.
  template <class WithOthers>
  void PushBending(uint32_t row, const WithOthers& with_others) {
    const bool has_before = row > 0, has_after = row + 1 < grid_.rows;
    const bool has_two_before = row > 1, has_two_after = row + 2 < grid_.rows;
    const auto along_row = access_.Forces(GridFamily::kRodsAlongRows, row);
    const auto rods_before = access_.Forces(GridFamily::kRodsAlongColumns, row + 2);  // of three
    const auto rods = access_.Forces(GridFamily::kRodsAlongColumns, row);
    const auto rods_after = access_.Forces(GridFamily::kRodsAlongColumns, row + 1);
    const auto cells_before = access_.Forces(GridFamily::kCells, row + 1);  // of two
    const auto cells = access_.Forces(GridFamily::kCells, row);
    for (int c = 0; c < columns_; c += kStep) {
      const Vectors middle = along_row.at(c);
      Vectors sum = (middle - along_row.at(c - 1)) + (middle - along_row.at(c + 1));
      if (has_before && has_after) {
        const Vectors twice = rods.at(c);
        sum = sum + (twice + twice);
      }
      if (has_two_before) sum = sum - rods_before.at(c);
      if (has_two_after) sum = sum - rods_after.at(c);
      if (has_after) sum = sum + (cells.at(c - 1) - cells.at(c));
      if (has_before) sum = sum + (cells_before.at(c) - cells_before.at(c - 1));
      access_.Push(row, c, with_others(c, sum));
    }
  }

  Access& access_;
  const GridElements& grid_;
  const int columns_;
  const Scalars rest_length_;
};

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
