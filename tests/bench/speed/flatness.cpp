// The cost of a cloth among few and among many, and of a particle in small and in large cloths:
// sizes in turn, round after round, so that disturbances of the machine hit all ->
// speed_flatness.csv.
#include <string>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/speed/turns.h"
#include "tests/bench/step_rows.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {

void MeasureFlatness(Bench& bench, FlatnessOptions options) {
  if (bench.is_quick()) {
    options.counts = {1, 5};
    options.cloth_particles = 64;
    options.particles = {64, 128};
    options.rounds = 2;
    options.turn_s = 0.001;
  }
  Table table =
      bench.OpenTable("speed_flatness", {"along", "backend", "cloths", "particles", "round", "ms"});
  const std::string backend = bench.fast_backend().name;
  const auto measure = [&](const std::string& along, std::vector<TurnTaker>& takers) {
    if (!bench.StartRow("flatness along the " + along)) return;
    for (uint32_t round = 0; round <= options.rounds; ++round) {
      for (TurnTaker& one : takers) {
        const double ms = one.Turn_ms(options.turn_s);
        if (round == 0) continue;  // warmed up
        table.Add({along, backend, one.cloths(), one.particles(), round, ms});
      }
    }
  };
  std::vector<TurnTaker> takers;
  const test::Scene small =
      MidSwing(bench, options.cloth_particles, Pins::kCorners, "REALTIME").scene;
  for (const uint32_t count : options.counts)
    takers.emplace_back(test::MakeBackend(backend), small, count);
  measure("cloths", takers);
  takers.clear();
  for (const uint32_t particles : options.particles) {
    const test::Scene start = MidSwing(bench, particles, Pins::kCorners, "REALTIME").scene;
    takers.emplace_back(test::MakeBackend(backend), start, 1);
  }
  measure("particles", takers);
}

}  // namespace drape::bench
