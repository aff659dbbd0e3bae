// Figure 3c: ms per step against the number of independent cloths.
#include <string>

#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {

void MeasureCloths(Bench& bench, ClothsOptions options) {
  if (bench.is_quick()) options = {{1, 4}, {64}, {"REALTIME"}};
  Table table = bench.OpenTable("cloths", StepColumns());
  for (const std::string& preset : options.presets) {
    for (const uint32_t particles : options.particles) {
      const test::Scene start = MidSwing(bench, particles, Pins::kCorners, preset).scene;
      for (const uint32_t count : options.counts) {
        const StepRow row{
            .preset = preset, .pins = "corners", .cloths = count, .particles = particles};
        if (!MeasureRow(bench, table, row, MakeBatch(start, count))) return;
      }
    }
  }
}

}  // namespace drape::bench
