// The elements of bending and shear of a grid along its rows, columns and diagonals: elements that
// are too fast for a substep are solved line by line (server/solver/method.md, "solve_elastic").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/elastic_elements.h"

namespace drape {

// Particles first, first + stride, ...: `count` of them.
struct ElasticLine {
  uint32_t first = 0;
  uint32_t stride = 0;
  uint32_t count = 0;        // >= 2
  uint32_t entry_begin = 0;  // place of its first particle in ElasticLines::stiffnesses_n_per_m
};

enum class ElasticKind {
  kRods,   // along rows or columns: one at each particle between two others
  kCells,  // their twist, along rows: one between a particle, the next, and those of the next row
  kDiagonals,  // along a diagonal: one from each particle to the next
};

// Elements of one kind and direction. No two lines of a family share a particle.
struct ElasticFamily {
  ElasticKind kind{};
  double rest_length_m = 0;
  uint32_t line_begin = 0;
  uint32_t line_end = 0;
};

struct ElasticLines {
  std::vector<ElasticFamily> families;  // in the order in which they are solved
  std::vector<ElasticLine> lines;
  // Of the element at each particle of each line, as ElasticKind says; 0 where there is none.
  std::vector<double> stiffnesses_n_per_m;

  bool empty() const { return families.empty(); }
};

// Every element of a grid is in one family; empty without elements or a grid (0 columns).
ElasticLines FindElasticLines(std::span<const ElasticElement> elements, uint32_t columns,
                              uint32_t rows);

// Largest s k times the inverse masses that an element of a line feels [-]: beyond, single
// precision does not resolve the masses beside it, and nobody tells the cloth from a rigid one.
// Stiffer families are softened to it.
inline constexpr double kMaxLineRatio = 1e5;

// What solves a line, at one of its particles (server/solver/method.md, "solve_elastic"). The
// matrix of the line is L D L^T, L with a unit diagonal:
// - rods: M + s K, acting on the particles of the line; pins have rows of their own and couple with
//   nothing;
// - cells: K^-1 + s J W J^T, acting on the impulses of the cells of the row, J W J^T with twice the
//   inverse masses where other cells share a particle, as (a + b)^2 <= 2 a^2 + 2 b^2.
// Diagonals depend on where the particles are.
struct ElasticEntry {
  double elasticity = 0;     // rods: stiffness [N/m]; diagonals: compliance [m/N], infinite
                             // where there is none; cells: 0
  double inverse_pivot = 0;  // rods [1/kg], 0 for pins; cells [N/m], 0 where there is none
  double to_next = 0;        // entry of L at the next particle or cell
  double to_second_next = 0;
};

// [stiffnesses_n_per_m.size()]. `s_s2`: at least the product of the interval of a substep and the
// time for which its forces act.
std::vector<ElasticEntry> DecomposeElasticLines(const ElasticLines& lines,
                                                std::span<const double> inverse_masses_per_kg,
                                                uint32_t columns, double s_s2);

}  // namespace drape
