// Many equal cloths on the cpu backend: side by side in the lanes of the vector registers against
// one by one, with one thread and with all.
#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {
namespace {

struct Contestant {
  uint32_t threads;
  bool use_lanes;
};

std::vector<Contestant> Contestants() {
  const uint32_t cores = std::max(std::thread::hardware_concurrency(), 1u);
  std::vector<Contestant> contestants = {{1, false}, {1, true}};
  if (cores > 1) contestants.insert(contestants.end(), {{cores, false}, {cores, true}});
  return contestants;
}

// Largest strain in the last of `seconds`, over all cloths, from the horizontal start.
double LateStrain(Backend& backend, const ClothBatch& batch, double seconds) {
  std::vector<StepItem> items;
  for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
    test::Scene scene = batch.scene;
    scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
    items.push_back({test::CreateCloth(backend, scene), {}, false});
  }
  const double step_s = batch.scene.parameters.settings.time_step_s;
  double max_strain = 0;
  for (double time_s = 0; time_s < seconds - step_s / 2; time_s += step_s) {
    for (StepItem& item : items) item.measure = time_s > seconds - 1;
    for (const StepReport& report : backend.Step(items).reports) {
      max_strain = std::max(max_strain, report.measured.max_strain);
    }
  }
  for (const StepItem& item : items) backend.Destroy(item.cloth);
  return max_strain;
}

}  // namespace

void MeasureLanes(Bench& bench, LanesOptions options) {
  if (bench.is_quick()) {
    options = {
        .counts = {5}, .particles = 64, .presets = {"REALTIME"}, .late_cloths = 3, .late_s = 0.1};
  }
  Table table = bench.OpenTable(
      "lanes", {"preset", "cloths", "particles", "threads", "path", "steps", "median_ms", "p10_ms",
                "p90_ms", "min_ms", "us_per_cloth", "iterations", "late_strain", "faulted"});
  const std::vector<Contestant> contestants = Contestants();
  std::vector<NamedBackend> backends;
  for (const auto& [threads, use_lanes] : contestants) {
    backends.push_back({"cpu", CreateCpuBackend({threads, use_lanes})});
  }
  for (const std::string& preset : options.presets) {
    const test::Scene still = Sheet(options.particles, Pins::kCorners, SettingsOf(preset));
    const test::Scene start = MidSwing(bench, options.particles, Pins::kCorners, preset).scene;
    double late_strain = -1;
    double slowest_ms = 0;  // of a cloth
    for (const uint32_t count : options.counts) {
      if (slowest_ms * count > 1000 * options.longest_step_s) break;
      if (!bench.StartRow(std::to_string(count) + " cloths, " + preset)) return;
      if (late_strain < 0) {
        late_strain = LateStrain(*backends.back().backend, MakeBatch(still, options.late_cloths),
                                 options.late_s);
      }
      const auto times = TimeSideBySide(backends, MakeBatch(start, count), bench.limits());
      for (size_t k = 0; k < times.size(); ++k) {
        const StepTimes& t = times[k];
        slowest_ms = std::max(slowest_ms, t.median_ms / count);
        table.Add({preset, count, options.particles, contestants[k].threads,
                   contestants[k].use_lanes ? "lanes" : "single", t.steps, t.median_ms, t.p10_ms,
                   t.p90_ms, t.min_ms, 1000 * t.median_ms / count, t.iterations, late_strain,
                   t.faulted});
      }
    }
  }
}

}  // namespace drape::bench
