// The subcommand `stability`: the atlas of tests/stability/atlas, every cell tried and judged.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/bench.h"

namespace drape::bench {

struct StabilityOptions {
  bool is_full = false;              // all values of every axis, all methods
  std::vector<std::string> tables;   // only these; empty: all
  std::vector<std::string> methods;  // only these; empty: all
  double cell_s = 10;                // no further step of a cell after that long
};
// -> stability.csv and, of random cloths (table "random"), stability_random.csv. The first backend
// plays everything, the others the thin form. A step that does not end within kHang_s ends the
// process, which names the cell.
inline constexpr double kHang_s = 120;
void MeasureStability(Bench& bench, const StabilityOptions& options);

}  // namespace drape::bench
