// ms per step against the number of equal cloths and against the particles of one, with the ways of
// stepping them side by side.
#include <algorithm>
#include <cstdio>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {
namespace {

// A way of stepping cloths. Those whose step would take longer than allowed leave the row out.
struct Way {
  std::string backend;
  std::string path;      // "lanes", "single"; empty: the backend's plan of the model
  uint32_t threads = 0;  // 0: not the cpu's
  std::unique_ptr<Backend> made = {};
  double us_per_particle = 0;  // of one cloth's share of the last row
};

std::vector<Way> MakeWays(const Bench& bench, bool has_single) {
  std::vector<Way> ways;
  const uint32_t cores = std::max(std::thread::hardware_concurrency(), 1u);
  std::vector<uint32_t> thread_counts = {1};
  if (cores > 1) thread_counts.push_back(cores);
  for (const std::string& name : bench.options().backends) {
    if (name == "reference") continue;  // the readable specification: nobody waits for it
    if (name != "cpu") {
      ways.push_back({name, "", 0, test::MakeBackend(name)});
      continue;
    }
    for (const uint32_t threads : thread_counts) {
      if (has_single)
        ways.push_back(
            {name, "single", threads, CreateCpuBackend({threads}, {.use_lanes = false})});
      ways.push_back({name, "lanes", threads, CreateCpuBackend({threads}, {.use_lanes = true})});
    }
  }
  return ways;
}

class CostTable {
 public:
  CostTable(Bench& bench, const CostOptions& options)
      : bench_(bench),
        options_(options),
        table_(bench.OpenTable(
            "speed_cost", {"along", "preset", "cloths", "particles", "constraints", "backend",
                           "path", "threads", "steps", "median_ms", "p10_ms", "p90_ms", "min_ms",
                           "dispatches", "iterations", "faulted"})) {}

  // False when the time of the run is used up.
  bool AddRow(const std::string& along, const std::string& preset, const test::Scene& start,
              uint32_t cloths, std::vector<Way>& ways) {
    const uint32_t particles = start.model->particle_count();
    std::vector<Way*> going;
    std::vector<NamedBackend> backends;
    for (Way& way : ways) {
      const double expected_ms = way.us_per_particle * particles * cloths / 1000;
      if (expected_ms > 1000 * options_.longest_step_s) continue;
      going.push_back(&way);
      backends.push_back({way.backend, std::move(way.made)});
    }
    if (going.empty()) return true;
    if (!bench_.StartRow(std::to_string(cloths) + " x " + std::to_string(particles) +
                         " particles, " + preset)) {
      return false;
    }
    const std::vector<StepTimes> times =
        TimeSideBySide(backends, MakeBatch(start, cloths), bench_.limits());
    for (size_t k = 0; k < going.size(); ++k) {
      Way& way = *going[k];
      way.made = std::move(backends[k].backend);
      way.us_per_particle = 1000 * times[k].median_ms / cloths / particles;
      Write(along, preset, *start.model, cloths, way, times[k]);
    }
    return true;
  }

 private:
  void Write(const std::string& along, const std::string& preset, const SceneModel& model,
             uint32_t cloths, const Way& way, const StepTimes& t) {
    const std::string path = way.path.empty() ? way.made->Describe().plan_of(model, {}) : way.path;
    std::printf("    %-4s %-8s %2u threads %10.3f ms  (%.3f ... %.3f, %u steps)\n",
                way.backend.c_str(), path.c_str(), way.threads, t.median_ms, t.p10_ms, t.p90_ms,
                t.steps);
    table_.Add({along, preset, cloths, model.particle_count(), model.constraint_count(),
                way.backend, path, way.threads, t.steps, t.median_ms, t.p10_ms, t.p90_ms, t.min_ms,
                t.dispatches, t.iterations, t.faulted});
  }

  Bench& bench_;
  const CostOptions& options_;
  Table table_;
};

}  // namespace

void MeasureCost(Bench& bench, CostOptions options) {
  if (bench.is_quick()) {
    options.counts = {5};
    options.few_counts = {1};
    options.cloth_particles = 64;
    options.particles = {64, 128};
  }
  CostTable table(bench, options);
  for (const char* preset : {"REALTIME", "PAPER", "ACCURATE"}) {
    const bool is_first = preset == std::string("REALTIME");
    const test::Scene start =
        MidSwing(bench, options.cloth_particles, Pins::kCorners, preset).scene;
    std::vector<Way> ways = MakeWays(bench, true);
    for (const uint32_t count : is_first ? options.counts : options.few_counts) {
      if (!table.AddRow("cloths", preset, start, count, ways)) return;
    }
  }
  std::vector<Way> ways = MakeWays(bench, false);  // one cloth is stepped alone on either path
  for (const uint32_t particles : options.particles) {
    const test::Scene start = MidSwing(bench, particles, Pins::kCorners, "REALTIME").scene;
    if (!table.AddRow("particles", "REALTIME", start, 1, ways)) return;
  }
}

}  // namespace drape::bench
