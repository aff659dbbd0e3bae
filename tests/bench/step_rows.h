// The table of "ms per step" that several subcommands fill.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/bench_scenes.h"

namespace drape::bench {

// The common part of the rows of all backends.
struct StepRow {
  std::string preset;
  std::string pins;
  uint32_t cloths = 1;
  uint32_t particles = 0;       // of one cloth
  double swing_max_strain = 0;  // on the way to where it is measured
};

// The columns are explained in README.md.
std::vector<std::string> StepColumns();

// Times the batch on every backend and adds a row for each. False when the budget is used up.
bool MeasureRow(Bench& bench, Table& table, const StepRow& row, const ClothBatch& batch);

// The time at which sheets are measured: half a second after their release, in the middle of the
// swing, when every constraint is active. The one start state of all backends comes from
// bench.fast_backend().
PreparedScene MidSwing(Bench& bench, uint32_t particles, Pins pins, const std::string& preset);

}  // namespace drape::bench
