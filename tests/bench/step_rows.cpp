#include "tests/bench/step_rows.h"
#include "tests/bench/bench_scenes.h"

#include <cstdio>

#include "tests/bench/subcommands.h"

namespace drape::bench {

constexpr uint32_t kSwingSteps = 30;

std::vector<std::string> StepColumns() {
  return {"preset",           "pins",     "cloths",       "particles",  "columns",    "rows",
          "backend",          "plan",     "steps",        "median_ms",  "p10_ms",     "p90_ms",
          "min_ms",           "max_ms",   "device_ms",    "dispatches", "iterations", "max_strain",
          "swing_max_strain", "contacts", "solves_per_s", "faulted"};
}

bool MeasureRow(Bench& bench, Table& table, const StepRow& row, const ClothBatch& batch) {
  if (!bench.StartRow(std::to_string(row.cloths) + " x " + std::to_string(row.particles) +
                      " particles, " + row.preset + ", pins: " + row.pins)) {
    return false;
  }
  const std::vector<StepTimes> times = TimeSideBySide(bench.backends(), batch, bench.limits());
  const GridSides sides = SidesOf(row.particles);
  for (size_t b = 0; b < times.size(); ++b) {
    const StepTimes& t = times[b];
    const NamedBackend& named = bench.backends()[b];
    std::printf("    %-10s %9.3f ms  (%.3f ... %.3f, %u steps)\n", named.name.c_str(), t.median_ms,
                t.p10_ms, t.p90_ms, t.steps);
    table.Add({row.preset,
               row.pins,
               row.cloths,
               row.particles,
               sides.columns,
               sides.rows,
               named.name,
               named.backend->Describe().plan_of(*batch.scene.model, batch.scene.parameters),
               t.steps,
               t.median_ms,
               t.p10_ms,
               t.p90_ms,
               t.min_ms,
               t.max_ms,
               t.device_ms,
               t.dispatches,
               t.iterations,
               t.max_strain,
               row.swing_max_strain,
               t.contacts,
               t.solves_per_second,
               t.faulted});
  }
  return true;
}

PreparedScene MidSwing(Bench& bench, uint32_t particles, Pins pins, const std::string& preset) {
  return Advance(*bench.fast_backend().backend, Sheet(particles, pins, SettingsOf(preset)),
                 bench.is_quick() ? 3 : kSwingSteps);
}

}  // namespace drape::bench
