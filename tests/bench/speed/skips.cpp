// What a scene does not need and what leaving it out saves, each on and off -> speed_skips.csv.
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/device_loop.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/gl_compute/gl_backend.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/speed.h"
#include "tests/support/backends.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

// Cloths that are stepped as the server steps them, without its sessions and its network.
class Stepper {
 public:
  Stepper(std::unique_ptr<Backend> backend, const ClothBatch& batch)
      : backend_(std::move(backend)) {
    for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
      test::Scene scene = batch.scene;
      scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
      cloths_.push_back(std::make_shared<ClothRuntime>());
      std::vector<Eigen::Vector3d> pins_m;
      for (const uint32_t p : scene.model->pins()) pins_m.push_back(scene.state.positions_m[p]);
      cloths_.back()->Begin(test::CreateCloth(*backend_, scene), scene.model,
                            scene.parameters.settings, ReportShift{}, pins_m, pins_m);
    }
  }

  // Wall time [ms] of each of `steps` steps of all cloths.
  std::vector<double> Step_ms(uint32_t steps, bool report) {
    std::vector<double> times_ms;
    for (uint32_t k = 0; k < steps; ++k) {
      StepWork work;
      work.cloths = cloths_;
      work.steps = 1;
      work.report = report;
      const auto start = std::chrono::steady_clock::now();
      loop_.Admit(std::move(work), clock_.NowUs());
      while (loop_.has_requests()) loop_.RunRound();
      const std::chrono::duration<double, std::milli> wall =
          std::chrono::steady_clock::now() - start;
      times_ms.push_back(wall.count());
    }
    return times_ms;
  }

  std::string Bits() {
    std::string bits;
    for (const auto& cloth : cloths_) bits += test::ReadBits(*backend_, cloth->handle());
    return bits;
  }

 private:
  std::unique_ptr<Backend> backend_;
  std::vector<std::shared_ptr<ClothRuntime>> cloths_;
  SteadyClock clock_;
  RoundCounters counters_;
  DeviceLoop loop_{*backend_,
                   {{16384, 16384}, 1000, kMaxSolvesPerStep},
                   clock_,
                   [](StepWork, StepOutcome) {},
                   counters_};
};

// Enough steps to fall and fall asleep.
constexpr uint32_t kRest = 180;

// Few and short on `gl`, which may be a software renderer: the sheets have fallen, and lie.
constexpr uint32_t kGlCloths = 2;
constexpr uint32_t kGlRest = 20;

// One thing that a scene may not need: cloths that have it anyway (full) and cloths that do not.
struct Skip {
  std::string name;
  test::Scene full, lean;
  bool full_is_reported = false;  // each step of `full` is measured
  uint32_t lead_steps = 0;        // before the timed ones, of both
  bool is_tilted = true;          // each cloth has its own gravity
  // The same cloths, with all colliders and without those out of reach, on this backend.
  std::string leaving_out = {};
  uint32_t cloths = 0;  // 0: SkipsOptions::cloths
};

test::Scene With(test::Scene scene, const StepSettings& settings) {
  scene.parameters.settings = settings;
  return scene;
}

// What the measurements are about.
struct Sheets {
  explicit Sheets(uint32_t side) {
    sleepless.sleep_motion_m = 0;
    hung = Sheet(side * side, Pins::kCorners, sleepless);
    on_ground = test::Grid(side, side, 1, 1);
    on_ground.parameters.settings = sleepless;
    on_ground.parameters.colliders = {
        PlaneCollider{Eigen::Vector3d(0, -0.05, 0), Eigen::Vector3d::UnitY()}};
    // Along the end in one step, so that a collider does not change how links are solved.
    StepSettings plain = sleepless;
    plain.integration = Integration::kOneStep;
    plain.direction = Direction::kAtEnd;
    plainly_hung = far_collider = With(hung, plain);
    far_collider.parameters.colliders = {SphereCollider{Eigen::Vector3d(0, 0, 100), 0.3}};
    far_colliders = far_collider;
    far_colliders.parameters.friction_static = far_colliders.parameters.friction_dynamic = 0.3;
    far_colliders.parameters.colliders.push_back(SphereCollider{Eigen::Vector3d(0, 0, -100), 0.3});
    far_colliders.parameters.colliders.push_back(
        PlaneCollider{Eigen::Vector3d(0, -100, 0), Eigen::Vector3d::UnitY()});
  }

  StepSettings sleepless = PresetSettings(Preset::kRealtime);
  test::Scene hung, plainly_hung, far_collider, far_colliders, on_ground;
};

std::vector<Skip> Skips(const Sheets& sheets) {
  StepSettings sleepy = sheets.sleepless;
  sleepy.sleep_motion_m = PresetSettings(Preset::kRealtime).sleep_motion_m;
  StepSettings swept = PresetSettings(Preset::kPaper);
  swept.tolerance = 0;
  return {
      {"sleep: all at rest on the ground", sheets.on_ground, With(sheets.on_ground, sleepy), false,
       kRest, false},
      {"sleep: all awake", sheets.hung, With(sheets.hung, sleepy)},
      {"early exit: at rest on the ground under PAPER", With(sheets.on_ground, swept),
       With(sheets.on_ground, PresetSettings(Preset::kPaper)), false, kRest, false},
      {"report of every step", sheets.hung, sheets.hung, true},
      {"a collider out of reach", sheets.far_collider, sheets.plainly_hung},
  };
}

// Leaving out colliders on one of the backends that do.
std::vector<Skip> LeavingOut(const Sheets& sheets, const std::string& backend, uint32_t cloths,
                             uint32_t lead_steps) {
  return {{.name = "colliders left out: one out of reach",
           .full = sheets.far_collider,
           .lean = sheets.far_collider,
           .leaving_out = backend,
           .cloths = cloths},
          {.name = "colliders left out: three out of reach with friction",
           .full = sheets.far_colliders,
           .lean = sheets.far_colliders,
           .leaving_out = backend,
           .cloths = cloths},
          {.name = "colliders left out: at rest on the ground",
           .full = sheets.on_ground,
           .lean = sheets.on_ground,
           .lead_steps = lead_steps,
           .is_tilted = false,
           .leaving_out = backend,
           .cloths = cloths}};
}

std::unique_ptr<Backend> BackendOf(const Skip& skip, const std::string& fast_backend,
                                   bool is_full) {
  if (skip.leaving_out.empty()) return test::MakeBackend(fast_backend);
  if (skip.leaving_out == "cpu") return CreateCpuBackend({.leave_out_colliders = !is_full});
  Result<std::unique_ptr<Backend>> gl = CreateGlBackend({.leave_out_colliders = !is_full});
  DRAPE_CHECK(gl.ok(), gl.status().ToString());
  return std::move(gl).value();
}

ClothBatch BatchOf(const test::Scene& scene, uint32_t cloths, bool is_tilted) {
  if (is_tilted) return MakeBatch(scene, cloths);
  return {scene, std::vector(cloths, scene.parameters.gravity_m_per_s2)};
}

}  // namespace

void MeasureSkips(Bench& bench, SkipsOptions options) {
  if (bench.is_quick()) options = {.cloths = 2, .side = 6, .turns = 1, .steps = 2};
  Table table = bench.OpenTable("speed_skips", {"skip", "backend", "cloths", "particles", "full_ms",
                                                "lean_ms", "same_state"});
  const std::string& fast_backend = bench.fast_backend().name;
  const Sheets sheets(options.side);
  std::vector<Skip> skips = Skips(sheets);
  const auto append = [&skips](std::vector<Skip> more) {
    skips.insert(skips.end(), more.begin(), more.end());
  };
  append(LeavingOut(sheets, "cpu", options.cloths, kRest));
  const bool has_gl = std::ranges::any_of(
      bench.backends(), [](const NamedBackend& backend) { return backend.name == "gl"; });
  if (has_gl) append(LeavingOut(sheets, "gl", kGlCloths, kGlRest));
  for (const Skip& skip : skips) {
    if (!bench.StartRow(skip.name)) return;
    const std::string& backend = skip.leaving_out.empty() ? fast_backend : skip.leaving_out;
    const uint32_t cloths = skip.cloths == 0 ? options.cloths : skip.cloths;
    Stepper full(BackendOf(skip, fast_backend, true), BatchOf(skip.full, cloths, skip.is_tilted));
    Stepper lean(BackendOf(skip, fast_backend, false), BatchOf(skip.lean, cloths, skip.is_tilted));
    full.Step_ms(skip.lead_steps, false);
    lean.Step_ms(skip.lead_steps, false);
    std::vector<double> full_ms, lean_ms;
    for (uint32_t turn = 0; turn <= options.turns; ++turn) {
      const std::vector<double> of_full = full.Step_ms(options.steps, skip.full_is_reported);
      const std::vector<double> of_lean = lean.Step_ms(options.steps, false);
      if (turn == 0) continue;  // warms up
      full_ms.insert(full_ms.end(), of_full.begin(), of_full.end());
      lean_ms.insert(lean_ms.end(), of_lean.begin(), of_lean.end());
    }
    table.Add({skip.name, backend, cloths, options.side * options.side, Quantile(full_ms, 0.5),
               Quantile(lean_ms, 0.5), full.Bits() == lean.Bits()});
  }
}

}  // namespace drape::bench
