#include "server/scene/elastic_lines.h"

#include <algorithm>
#include <array>
#include <limits>

namespace drape {
namespace {

// The lines of a grid in one direction, and where each particle is in them.
class Direction {
 public:
  Direction(uint32_t columns, uint32_t rows, int column_step, int row_step, ElasticLines& lines)
      : stride_(static_cast<uint32_t>(row_step * static_cast<int>(columns) + column_step)),
        lines_(lines),
        entries_(size_t{columns} * rows) {
    line_begin_ = static_cast<uint32_t>(lines.lines.size());
    for (uint32_t row = 0; row < rows; ++row) {
      for (uint32_t column = 0; column < columns; ++column) {
        const int64_t before_row = int64_t{row} - row_step;
        const int64_t before_column = int64_t{column} - column_step;
        const bool is_first = before_row < 0 || before_column < 0 || before_column >= columns;
        if (is_first) AddLine(columns, rows, row, column, column_step, row_step);
      }
    }
  }

  uint32_t stride() const { return stride_; }
  double& StiffnessAt(uint32_t particle) { return lines_.stiffnesses_n_per_m[entries_[particle]]; }
  void DropLinesWithoutElements() {
    const auto begin = lines_.lines.begin() + line_begin_;
    lines_.lines.erase(
        std::remove_if(
            begin, lines_.lines.end(),
            [&](const ElasticLine& line) {
              return std::ranges::all_of(
                  std::span(lines_.stiffnesses_n_per_m).subspan(line.entry_begin, line.count),
                  [](double k) { return k == 0; });
            }),
        lines_.lines.end());
  }
  ElasticFamily Family(ElasticKind kind, double rest_length_m) const {
    return {kind, rest_length_m, line_begin_, static_cast<uint32_t>(lines_.lines.size())};
  }

 private:
  void AddLine(uint32_t columns, uint32_t rows, uint32_t row, uint32_t column, int column_step,
               int row_step) {
    ElasticLine line{.first = row * columns + column,
                     .stride = stride_,
                     .entry_begin = static_cast<uint32_t>(lines_.stiffnesses_n_per_m.size())};
    int64_t r = row, c = column;
    for (; r < rows && c >= 0 && c < columns; r += row_step, c += column_step) {
      entries_[line.first + line.count * stride_] = line.entry_begin + line.count;
      ++line.count;
    }
    if (line.count < 2) return;
    lines_.lines.push_back(line);
    lines_.stiffnesses_n_per_m.resize(line.entry_begin + line.count, 0.0);
  }

  uint32_t stride_;
  ElasticLines& lines_;
  uint32_t line_begin_ = 0;
  std::vector<uint32_t> entries_;  // [particle_count]
};

bool IsCell(const ElasticElement& element) {
  return element.weights[3] != 0;
}
bool IsRod(const ElasticElement& element) {
  return !IsCell(element) && element.weights[2] != 0;
}
bool IsDiagonal(const ElasticElement& element) {
  return element.weights[2] == 0;
}

// From the first to the second particle of a diagonal, from the middle of a rod to the particle
// after it.
uint32_t StrideOf(const ElasticElement& element) {
  return IsRod(element) ? element.particles[2] - element.particles[0]
                        : element.particles[1] - element.particles[0];
}

void AddFamily(std::span<const ElasticElement> elements, ElasticKind kind,
               bool (*is_of_kind)(const ElasticElement&), Direction direction,
               ElasticLines& lines) {
  double rest_length_m = 0;
  for (const ElasticElement& element : elements) {
    if (!is_of_kind(element) || StrideOf(element) != direction.stride()) continue;
    direction.StiffnessAt(element.particles[0]) = element.stiffness_n_per_m;
    rest_length_m = element.rest_length_m;
  }
  // Of the diagonals in one direction, every second line.
  if (kind == ElasticKind::kDiagonals) direction.DropLinesWithoutElements();
  lines.families.push_back(direction.Family(kind, rest_length_m));
}

// A row of K: its diagonal and its entries at the next two particles.
using BandRow = std::array<double, 3>;

std::vector<BandRow> RodBand(std::span<const double> stiffnesses) {
  constexpr std::array<double, 3> kSecond = {1, -2, 1};
  std::vector<BandRow> band(stiffnesses.size(), {0, 0, 0});
  for (size_t i = 1; i + 1 < band.size(); ++i) {
    for (size_t a = 0; a < 3; ++a) {
      for (size_t b = a; b < 3; ++b) {
        band[i - 1 + a][b - a] += stiffnesses[i] * kSecond[a] * kSecond[b];
      }
    }
  }
  return band;
}

void DecomposeRods(std::span<const double> w, const ElasticLine& line, double s_s2,
                   std::span<const BandRow> band, std::span<ElasticEntry> entries) {
  const auto w_at = [&](uint32_t i) { return w[line.first + i * line.stride]; };
  std::array<double, 2> before = {0, 0};  // pivots of the particles before
  for (uint32_t i = 0; i < line.count; ++i) {
    ElasticEntry& entry = entries[i];
    if (w_at(i) == 0) {
      before = {0, before[0]};
      continue;
    }
    double diagonal = 1 / w_at(i) + s_s2 * band[i][0];
    double next = i + 1 < line.count && w_at(i + 1) > 0 ? s_s2 * band[i][1] : 0;
    const double second = i + 2 < line.count && w_at(i + 2) > 0 ? s_s2 * band[i][2] : 0;
    if (i > 0) {
      diagonal -= entries[i - 1].to_next * entries[i - 1].to_next * before[0];
      next -= entries[i - 1].to_next * entries[i - 1].to_second_next * before[0];
    }
    if (i > 1) {
      diagonal -= entries[i - 2].to_second_next * entries[i - 2].to_second_next * before[1];
    }
    entry.inverse_pivot = 1 / diagonal;
    entry.to_next = next / diagonal;
    entry.to_second_next = second / diagonal;
    before = {diagonal, before[0]};
  }
}

// The lines of a family under way, and how much of their stiffness it keeps.
class Decomposition {
 public:
  Decomposition(const ElasticLines& lines, const ElasticFamily& family, std::span<const double> w,
                uint32_t columns, double s_s2, std::vector<ElasticEntry>& entries)
      : lines_(lines), family_(family), w_(w), columns_(columns), s_s2_(s_s2), entries_(entries) {}

  void Rods() {
    double largest = 0;  // s K over M
    for (const ElasticLine& line : all()) {
      const std::vector<BandRow> band = RodBand(StiffnessesOf(line));
      for (uint32_t i = 0; i < line.count; ++i) {
        largest = std::max(largest, s_s2_ * band[i][0] * w_[line.first + i * line.stride]);
      }
    }
    const double share = largest > kMaxLineRatio ? kMaxLineRatio / largest : 1;
    for (const ElasticLine& line : all()) {
      const std::span<const double> k = StiffnessesOf(line);
      const std::span<ElasticEntry> entries = EntriesOf(line);
      for (uint32_t i = 0; i < line.count; ++i) entries[i].elasticity = share * k[i];
      DecomposeRods(w_, line, share * s_s2_, RodBand(k), entries);
    }
  }

  void Diagonals() {
    double largest = 0;  // inverse mass that a diagonal feels [1/kg]
    for (const ElasticLine& line : all()) {
      for (uint32_t i = 0; i + 1 < line.count; ++i) {
        const uint32_t particle = line.first + i * line.stride;
        largest = std::max(largest, w_[particle] + w_[particle + line.stride]);
      }
    }
    for (const ElasticLine& line : all()) {
      for (uint32_t i = 0; i < line.count; ++i) {
        EntriesOf(line)[i].elasticity = Compliance(StiffnessesOf(line)[i], largest);
      }
    }
  }

  void Cells() {
    double largest = 0;
    for (const ElasticLine& line : all()) {
      for (uint32_t i = 0; i + 1 < line.count; ++i) {
        largest = std::max(largest, RungInverseMass(line, i) + RungInverseMass(line, i + 1));
      }
    }
    for (const ElasticLine& line : all()) {
      const std::span<const double> k = StiffnessesOf(line);
      const std::span<ElasticEntry> entries = EntriesOf(line);
      double before = 0;  // pivot of the cell before
      for (uint32_t i = 0; i + 1 < line.count; ++i) {
        if (k[i] == 0) {  // of pins alone
          before = 0;
          continue;
        }
        const double next = RungInverseMass(line, i + 1);
        double pivot = Compliance(k[i], largest) + s_s2_ * (RungInverseMass(line, i) + next);
        if (i > 0) pivot -= entries[i - 1].to_next * entries[i - 1].to_next * before;
        entries[i].inverse_pivot = 1 / pivot;
        if (k[i + 1] != 0) entries[i].to_next = -s_s2_ * next / pivot;
        before = pivot;
      }
    }
  }

 private:
  std::span<const ElasticLine> all() const {
    return std::span(lines_.lines)
        .subspan(family_.line_begin, family_.line_end - family_.line_begin);
  }
  std::span<const double> StiffnessesOf(const ElasticLine& line) const {
    return std::span(lines_.stiffnesses_n_per_m).subspan(line.entry_begin, line.count);
  }
  std::span<ElasticEntry> EntriesOf(const ElasticLine& line) const {
    return std::span(entries_).subspan(line.entry_begin, line.count);
  }
  // None: between pins alone, and at the last particle of a line.
  double Compliance(double stiffness_n_per_m, double largest_per_kg) const {
    if (stiffness_n_per_m == 0) return std::numeric_limits<double>::infinity();
    return std::max(1 / stiffness_n_per_m, s_s2_ * largest_per_kg / kMaxLineRatio);
  }
  // Of the two particles that the cells before and after place i share, each counted as often as
  // rows of cells have it.
  double RungInverseMass(const ElasticLine& line, uint32_t i) const {
    const bool is_first = &line == &all().front(), is_last = &line == &all().back();
    return (is_first ? 1 : 2) * w_[line.first + i] +
           (is_last ? 1 : 2) * w_[line.first + columns_ + i];
  }

  const ElasticLines& lines_;
  const ElasticFamily& family_;
  const std::span<const double> w_;
  const uint32_t columns_;
  const double s_s2_;
  std::vector<ElasticEntry>& entries_;
};

}  // namespace

ElasticLines FindElasticLines(std::span<const ElasticElement> elements, uint32_t columns,
                              uint32_t rows) {
  ElasticLines lines;
  if (columns == 0) return lines;
  const auto direction = [&](int column_step, int row_step) {
    return Direction(columns, rows, column_step, row_step, lines);
  };
  if (std::ranges::any_of(elements, IsRod)) {
    // A single column has rods of the same stride as a single row.
    if (columns > 1) AddFamily(elements, ElasticKind::kRods, IsRod, direction(1, 0), lines);
    if (rows > 1) AddFamily(elements, ElasticKind::kRods, IsRod, direction(0, 1), lines);
  }
  if (std::ranges::any_of(elements, IsDiagonal)) {
    AddFamily(elements, ElasticKind::kDiagonals, IsDiagonal, direction(1, 1), lines);
    AddFamily(elements, ElasticKind::kDiagonals, IsDiagonal, direction(-1, 1), lines);
  }
  if (std::ranges::any_of(elements, IsCell)) {
    AddFamily(elements, ElasticKind::kCells, IsCell, Direction(columns, rows - 1, 1, 0, lines),
              lines);
  }
  return lines;
}

std::vector<ElasticEntry> DecomposeElasticLines(const ElasticLines& lines,
                                                std::span<const double> inverse_masses_per_kg,
                                                uint32_t columns, double s_s2) {
  std::vector<ElasticEntry> entries(lines.stiffnesses_n_per_m.size());
  for (const ElasticFamily& family : lines.families) {
    Decomposition decomposition(lines, family, inverse_masses_per_kg, columns, s_s2, entries);
    switch (family.kind) {
      case ElasticKind::kRods:
        decomposition.Rods();
        break;
      case ElasticKind::kDiagonals:
        decomposition.Diagonals();
        break;
      case ElasticKind::kCells:
        decomposition.Cells();
        break;
    }
  }
  return entries;
}

}  // namespace drape
