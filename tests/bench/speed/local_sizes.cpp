// Steps of the backend gl with each local size (invocations per work group), the sizes in turn ->
// speed_local_sizes.csv, and several small sheets in one work group -> speed_packing.csv. The best
// sizes of a device belong in server/solver/gl_compute/local_sizes.cpp.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/gl_compute/gl_tuning.h"
#include "server/solver/gl_compute/kernel_variant.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/speed/turns.h"
#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {
namespace {

// The backend gl with work groups of the given sizes (0: the product's choice).
struct Wanted {
  uint32_t local_size = 0;
  uint32_t refine_local_size = 0;
};

// Null, with a line of output, where the device refuses kernels of these sizes.
std::unique_ptr<Backend> MakeBackendOf(const Wanted& wanted, const test::Scene& start) {
  Result<std::unique_ptr<Backend>> backend = CreateTunedGlBackend(
      {}, {.local_size = wanted.local_size, .refine_local_size = wanted.refine_local_size});
  Status status = backend.status();
  if (backend.ok()) {
    const auto cloth = (*backend)->Create(start.model, start.parameters, start.state);
    if (cloth.ok()) {
      (*backend)->Destroy(*cloth);
      return std::move(*backend);
    }
    status = cloth.status();
  }
  std::printf("    %4u invocations, %4u that refine: %s\n", wanted.local_size,
              wanted.refine_local_size, status.ToString().c_str());
  return nullptr;
}

// How the product steps the cloth; null where it refuses.
std::optional<KernelVariant> VariantOf(const Backend& gl, const Wanted& wanted,
                                       const test::Scene& scene) {
  const BackendDescription description = gl.Describe();
  // The product decides by the renderer's name alone.
  const std::string renderer = description.device.substr(0, description.device.find(", OpenGL "));
  const DeviceTraits traits = {.is_software = !description.is_hardware_gpu,
                               .renderer = renderer,
                               .local_size = wanted.local_size,
                               .refine_local_size = wanted.refine_local_size,
                               .loop_budget = UINT32_MAX,
                               .strip_solve = description.is_hardware_gpu
                                                  ? StripSolve::kFromBothEnds
                                                  : StripSolve::kElimination};
  const Result<VariantChoice> choice =
      ChooseVariant(PlanOnDevice(*scene.model, scene.parameters), traits);
  if (!choice.ok()) return std::nullopt;
  return choice->variant;
}

// One size of work groups for one load.
struct SizeTimes {
  uint32_t local_size;
  TurnTaker cloths;
  std::vector<double> ms = {};
};

class LocalSizesTable {
 public:
  LocalSizesTable(Bench& bench, const LocalSizesOptions& options, const Backend& gl)
      : bench_(bench),
        options_(options),
        gl_(gl),
        table_(bench.OpenTable(
            "speed_local_sizes",
            {"preset", "plan", "kernels", "cloths", "particles", "local_size", "is_chosen",
             "rounds", "median_ms", "p10_ms", "p90_ms", "ns_per_particle"})) {}

  // False when the time of the run is used up.
  bool AddRows(const std::string& preset, const LocalSizesLoad& load) {
    if (!Start(preset, load, "")) return false;
    const test::Scene start = MidSwing(bench_, load.particles, Pins::kCorners, preset).scene;
    const std::optional<KernelVariant> chosen = VariantOf(gl_, {}, start);
    if (!chosen) return true;
    // A cloth has no use for more invocations than particles, except for 64, a size that GPUs are
    // made for.
    const uint32_t most = std::max(load.particles, 64u);
    // Hardware runs 32 invocations at least, and compiling each size takes its time from the
    // others.
    const uint32_t least = gl_.Describe().is_hardware_gpu ? 32 : 0;
    std::vector<SizeTimes> sizes;
    for (const uint32_t size : options_.sizes) {
      const Wanted wanted{size, chosen->refine_local_size};
      // Strips by lanes need at least the invocations of a subgroup.
      const std::optional<KernelVariant> variant = VariantOf(gl_, wanted, start);
      if (size >= least && size <= most && variant && variant->local_size == size) {
        AddSize(sizes, wanted, size, start, load);
      }
    }
    Measure(sizes, "step", preset, load, start, chosen->local_size);
    if (chosen->refine_local_size == 0) return true;
    if (!Start(preset, load, ", refining")) return false;
    sizes.clear();
    for (const uint32_t size : options_.sizes) {
      AddSize(sizes, {chosen->local_size, size}, size, start, load);
    }
    Measure(sizes, "refine", preset, load, start, chosen->refine_local_size);
    return true;
  }

 private:
  bool Start(const std::string& preset, const LocalSizesLoad& load, const char* what) {
    return bench_.StartRow("local sizes of " + std::to_string(load.cloths) + " x " +
                           std::to_string(load.particles) + " particles, " + preset + what);
  }

  static void AddSize(std::vector<SizeTimes>& sizes, const Wanted& wanted, uint32_t size,
                      const test::Scene& start, const LocalSizesLoad& load) {
    std::unique_ptr<Backend> backend = MakeBackendOf(wanted, start);
    if (backend) sizes.push_back({size, TurnTaker(std::move(backend), start, load.cloths)});
  }

  void Measure(std::vector<SizeTimes>& sizes, const char* kernels, const std::string& preset,
               const LocalSizesLoad& load, const test::Scene& start, uint32_t chosen) {
    TakeTurns(sizes, options_.rounds, options_.turn_s);
    for (const SizeTimes& size : sizes) {
      const double median_ms = Quantile(size.ms, 0.5);
      const double ns_per_particle = 1e6 * median_ms / load.cloths / load.particles;
      const bool is_chosen = size.local_size == chosen;
      std::printf("    %4u invocations%c %10.3f ms, %8.1f ns per particle\n", size.local_size,
                  is_chosen ? '*' : ' ', median_ms, ns_per_particle);
      table_.Add({preset, gl_.Describe().plan_of(*start.model, start.parameters), kernels,
                  load.cloths, load.particles, size.local_size, is_chosen, options_.rounds,
                  median_ms, Quantile(size.ms, 0.1), Quantile(size.ms, 0.9), ns_per_particle});
    }
  }

  Bench& bench_;
  const LocalSizesOptions& options_;
  const Backend& gl_;
  Table table_;
};

// `count` sheets of `side` x `side` particles in one cloth: the work of a group that steps several
// small cloths. As particles and links, since a grid is one sheet.
test::Scene SheetsInOne(uint32_t side, uint32_t count, const StepSettings& settings) {
  const double edge_m = 1.0 / (side - 1);
  ParticleTopology sheets;
  std::vector<uint32_t> pins;
  for (uint32_t sheet = 0; sheet < count; ++sheet) {
    const auto first = static_cast<uint32_t>(sheets.positions_m.size());
    pins.insert(pins.end(), {first, first + side - 1});
    for (uint32_t k = 0; k < side * side; ++k) {
      const uint32_t row = k / side, column = k % side, i = first + k;
      sheets.positions_m.emplace_back(2.0 * sheet + edge_m * column, 0, edge_m * row);
      sheets.masses_kg.push_back(0.2 / side / side);
      if (column > 0) sheets.distance_constraints.push_back({i - 1, i, edge_m, 0});
      if (row > 0) sheets.distance_constraints.push_back({i - side, i, edge_m, 0});
    }
  }
  test::Scene scene = test::Particles(sheets, std::move(pins));
  scene.parameters.settings = settings;
  return scene;
}

// Several small cloths in a work group -> speed_packing.csv. All packings of sheets of a size take
// turns. False when the time is used up.
bool MeasurePacking(Bench& bench, const LocalSizesOptions& options, bool is_hardware) {
  Table table =
      bench.OpenTable("speed_packing", {"particles", "sheets_per_group", "sheets", "local_size",
                                        "rounds", "median_ms", "us_per_sheet"});
  const uint32_t sheets =
      is_hardware ? options.hardware_packed_sheets : options.software_packed_sheets;
  for (const uint32_t side : options.packed_sides) {
    const uint32_t particles = side * side;
    if (!bench.StartRow("sheets of " + std::to_string(particles) + " particles, packed")) {
      return false;
    }
    std::vector<SizeTimes> sizes;
    for (const uint32_t per_group : options.sheets_per_group) {
      const test::Scene packed = SheetsInOne(side, per_group, SettingsOf("REALTIME"));
      const uint32_t steps = bench.is_quick() ? 3 : 30;
      const test::Scene start = Advance(*bench.fast_backend().backend, packed, steps).scene;
      for (const uint32_t size : options.sizes) {
        if (size > std::max(particles * per_group, 64u)) continue;
        std::unique_ptr<Backend> backend = MakeBackendOf({size, 0}, start);
        const uint32_t groups = std::max(sheets / per_group, 1u);
        if (backend) sizes.push_back({size, TurnTaker(std::move(backend), start, groups)});
      }
    }
    TakeTurns(sizes, options.rounds, options.turn_s);
    for (const SizeTimes& size : sizes) {
      const double median_ms = Quantile(size.ms, 0.5);
      const uint32_t per_group = size.cloths.particles() / particles;
      const uint32_t stepped = size.cloths.cloths() * per_group;
      const double us_per_sheet = 1e3 * median_ms / stepped;
      std::printf("    %2u per group, %4u invocations %10.3f ms, %8.2f us per sheet\n", per_group,
                  size.local_size, median_ms, us_per_sheet);
      table.Add({particles, per_group, stepped, size.local_size, options.rounds, median_ms,
                 us_per_sheet});
    }
  }
  return true;
}

}  // namespace

void MeasureLocalSizes(Bench& bench, LocalSizesOptions options) {
  if (bench.is_quick()) {
    options.presets = {"REALTIME"};
    options.software_loads = options.hardware_loads = {{2, 16}, {1, 1089}};
    options.sizes = {8, 32};
    options.packed_sides = {4};
    options.sheets_per_group = {1, 2};
    options.software_packed_sheets = options.hardware_packed_sheets = 4;
    options.rounds = 2;
    options.turn_s = 0.001;
  }
  const std::unique_ptr<Backend> gl = test::MakeBackend("gl");
  const bool is_hardware = gl->Describe().is_hardware_gpu;
  LocalSizesTable table(bench, options, *gl);
  for (const std::string& preset : options.presets) {
    for (const LocalSizesLoad& load :
         is_hardware ? options.hardware_loads : options.software_loads) {
      if (!table.AddRows(preset, load)) return;
    }
    // Before the other presets, which matter less if time is short.
    if (preset == options.presets.front() && !MeasurePacking(bench, options, is_hardware)) return;
  }
}

}  // namespace drape::bench
