// Savings from leaving out unneeded work, each on and off -> speed_skips.csv.
#include <algorithm>
#include <chrono>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/device_loop.h"
#include "server/scheduler/observers.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/speed.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

// An hour: every batch holds all cloths.
constexpr int64_t kNoBudget_us = 3'600'000'000;

// One of the two sides of a comparison: cloths, and what each request for a step of them asks for.
struct Side {
  test::Scene scene;
  bool is_reported = false;     // each step is measured
  StateFields view = {};        // states after each step
  bool is_subscribed = false;   // someone gets the positions of those that change
  bool sets_pins = false;       // to where they are
  bool has_own_models = false;  // a copy for each cloth
};

// Cloths that are stepped as the server steps them, without its sessions and its network.
class Stepper {
 public:
  Stepper(std::unique_ptr<Backend> backend, const Side& side, const ClothBatch& batch)
      : backend_(std::move(backend)), side_(side) {
    for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
      test::Scene scene = batch.scene;
      scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
      if (side.has_own_models) scene.model = std::make_shared<const SceneModel>(*scene.model);
      cloths_.push_back(std::make_shared<ClothRuntime>());
      std::vector<Eigen::Vector3d> pins_m;
      for (const uint32_t p : scene.model->pins()) pins_m.push_back(scene.state.positions_m[p]);
      cloths_.back()->Begin(test::CreateCloth(*backend_, scene), scene.model,
                            scene.parameters.settings, ReportShift{}, pins_m, pins_m);
      if (side.sets_pins) AddPinControls(scene, pins_m);
    }
    if (side.is_subscribed) Subscribe();
  }

  // Wall time [ms] of each of `steps` steps of all cloths.
  std::vector<double> Step_ms(uint32_t steps) {
    std::vector<double> times_ms;
    for (uint32_t k = 0; k < steps; ++k) {
      StepWork work;
      work.cloths = cloths_;
      work.steps = 1;
      work.report = side_.is_reported;
      work.view = side_.view;
      work.controls.pins = pin_controls_;
      const auto start = std::chrono::steady_clock::now();
      loop_.Admit(std::move(work), clock_.NowUs());
      while (loop_.has_requests()) loop_.RunRound();
      loop_.GiveAnswers();
      observers_.Serve(*backend_, clock_.NowUs());
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
  void AddPinControls(const test::Scene& scene, const std::vector<Eigen::Vector3d>& pins_m) {
    const auto cloth_index = static_cast<uint32_t>(cloths_.size() - 1);
    for (size_t k = 0; k < pins_m.size(); ++k) {
      pin_controls_.push_back({cloth_index, {scene.model->pins()[k], pins_m[k], 0}});
    }
  }

  void Subscribe() {
    observer_ = std::make_shared<Observer>([] {});
    ObserverSpec spec;
    spec.cloths = cloths_;
    spec.fields.positions = true;
    spec.initial_credit = 1;
    spec.on_frame = [this](const ObservedFrame&) { observer_->AddCredit(1); };
    spec.on_end = [](const Status&) {};
    observers_.Add(std::move(spec), observer_);
  }

  std::unique_ptr<Backend> backend_;
  const Side side_;
  std::vector<std::shared_ptr<ClothRuntime>> cloths_;
  std::vector<ClothControl<PinControl>> pin_controls_;
  SteadyClock clock_;
  RoundCounters counters_;
  RateQuota rates_{clock_};
  DeviceLoop loop_{*backend_, {{16384, 16384}, 1000, kNoBudget_us},
                   clock_,    [](StepWork, StepOutcome) {},
                   counters_, rates_};
  std::shared_ptr<Observer> observer_;
  ObserverSet observers_{[](const std::function<void()>& complete) { complete(); }};
};

// Enough steps to fall and fall asleep.
constexpr uint32_t kRest = 180;

// Few and short on a software renderer: the sheets have fallen and are at rest.
constexpr uint32_t kSoftwareCloths = 2;
constexpr uint32_t kSoftwareRest = 20;

// One thing that a scene may not need: cloths that have it anyway (full) and cloths that do not.
struct Skip {
  std::string name;
  Side full, lean;
  uint32_t lead_steps = 0;   // before the timed ones, of both
  bool is_tilted = true;     // each cloth has its own gravity
  std::string backend = {};  // empty: the fast one
  uint32_t cloths = 0;       // 0: SkipsOptions::cloths
  // The same cloths, with all colliders and without those out of reach.
  bool leaves_out = false;
  // The same on gl, with lists of the particles and rest lengths of regular strips and without.
  bool is_of_lists = false;
};

test::Scene With(test::Scene scene, const StepSettings& settings) {
  scene.parameters.settings = settings;
  return scene;
}

// The sheets of the measurements.
struct Sheets {
  explicit Sheets(uint32_t particles_of_a_side) : side(particles_of_a_side) {
    sleepless.sleep_motion_m = 0;
    hung = Sheet(side * side, Pins::kCorners, sleepless);
    burdened = Burdened(hung);
    std::vector<uint32_t> upper_half(side / 2 * side);
    std::iota(upper_half.begin(), upper_half.end(), 0);
    half_pinned = test::Grid(side, side, 1, 1, upper_half);
    half_pinned.parameters.settings = sleepless;
    on_ground = test::Grid(side, side, 1, 1);
    on_ground.parameters.settings = sleepless;
    on_ground.parameters.colliders = {
        PlaneThrough(Eigen::Vector3d(0, -0.05, 0), Eigen::Vector3d::UnitY())};
    // Along the end in one step, so that a collider does not change how links are solved.
    StepSettings plain = sleepless;
    plain.integration = Integration::kOneStep;
    plain.direction = Direction::kAtEnd;
    plainly_hung = far_collider = With(hung, plain);
    far_collider.parameters.colliders = {SphereAt(Eigen::Vector3d(0, 0, 100), 0.3)};
    far_colliders = far_collider;
    far_colliders.parameters.friction_static = far_colliders.parameters.friction_dynamic = 0.3;
    far_colliders.parameters.colliders.push_back(SphereAt(Eigen::Vector3d(0, 0, -100), 0.3));
    far_colliders.parameters.colliders.push_back(
        PlaneThrough(Eigen::Vector3d(0, -100, 0), Eigen::Vector3d::UnitY()));
  }

  // With parts that make steps longer and change nothing.
  static test::Scene Burdened(test::Scene scene) {
    ClothParameters& parameters = scene.parameters;
    parameters.air_drag = 1e-30;
    return scene;
  }

  const uint32_t side;
  StepSettings sleepless = PresetSettings(Preset::kRealtime), sleepy = sleepless;
  test::Scene hung, burdened, half_pinned, plainly_hung, far_collider, far_colliders, on_ground;
};

std::vector<Skip> Skips(const Sheets& sheets) {
  const StateFields both{.positions = true, .velocities = true};
  const uint32_t last = sheets.hung.model->particle_count() - 1, side = sheets.side;
  const StateFields corners{.positions = true, .particles = {0, side - 1, last + 1 - side, last}};
  StepSettings swept = PresetSettings(Preset::kPaper);
  swept.tolerance = 0;
  const test::Scene resting = With(sheets.on_ground, sheets.sleepy);
  return {
      {"sleep: all at rest on the ground", {sheets.on_ground}, {resting}, kRest, false},
      {"sleep: all awake", {sheets.hung}, {With(sheets.hung, sheets.sleepy)}},
      {"early exit: at rest on the ground under PAPER",
       {With(sheets.on_ground, swept)},
       {With(sheets.on_ground, PresetSettings(Preset::kPaper))},
       kRest,
       false},
      {"report of every step", {.scene = sheets.hung, .is_reported = true}, {sheets.hung}},
      {"a collider out of reach", {sheets.far_collider}, {sheets.plainly_hung}},
      {"readback: positions and velocities", {.scene = sheets.hung, .view = both}, {sheets.hung}},
      {"readback: velocities beside positions",
       {.scene = sheets.hung, .view = both},
       {.scene = sheets.hung, .view = {.positions = true}}},
      {"readback: all particles or those of the corners",
       {.scene = sheets.hung, .view = {.positions = true}},
       {.scene = sheets.hung, .view = corners}},
      {"unchanged states: all asleep and read or subscribed to",
       {.scene = resting, .view = {.positions = true}},
       {.scene = resting, .is_subscribed = true},
       kRest,
       false},
      {"unchanged states: all awake and read or subscribed to",
       {.scene = sheets.hung, .view = {.positions = true}},
       {.scene = sheets.hung, .is_subscribed = true}},
      {"controls: pins set where they are",
       {.scene = sheets.hung, .sets_pins = true},
       {sheets.hung}},
      {"a whole sheet or one half pinned", {sheets.hung}, {sheets.half_pinned}},
  };
}

// The gains of code that is compiled or chosen for the features of the cloths, and of one copy of
// shared data.
std::vector<Skip> OfBackend(const Sheets& sheets, const std::string& backend, uint32_t cloths) {
  return {{.name = "variants: air that does nothing",
           .full = {sheets.burdened},
           .lean = {sheets.hung},
           .backend = backend,
           .cloths = cloths},
          {.name = "shared topology: a model for each sheet",
           .full = {.scene = sheets.hung, .has_own_models = true},
           .lean = {sheets.hung},
           .backend = backend,
           .cloths = cloths}};
}

// Leaving out colliders on one of the backends that do.
std::vector<Skip> LeavingOut(const Sheets& sheets, const std::string& backend, uint32_t cloths,
                             uint32_t lead_steps) {
  return {{.name = "colliders left out: one out of reach",
           .full = {sheets.far_collider},
           .lean = {sheets.far_collider},
           .backend = backend,
           .cloths = cloths,
           .leaves_out = true},
          {.name = "colliders left out: three out of reach with friction",
           .full = {sheets.far_colliders},
           .lean = {sheets.far_colliders},
           .backend = backend,
           .cloths = cloths,
           .leaves_out = true},
          {.name = "colliders left out: at rest on the ground",
           .full = {sheets.on_ground},
           .lean = {sheets.on_ground},
           .lead_steps = lead_steps,
           .is_tilted = false,
           .backend = backend,
           .cloths = cloths,
           .leaves_out = true}};
}

std::unique_ptr<Backend> BackendOf(const Skip& skip, bool is_full) {
  if (!skip.leaves_out && !skip.is_of_lists) return test::MakeBackend(skip.backend);
  if (skip.backend == "cpu") return CreateCpuBackend({}, {.leave_out_colliders = !is_full});
  GlTuning tuning;
  if (skip.leaves_out) tuning.leave_out_colliders = !is_full;
  if (skip.is_of_lists) tuning.find_regular_strips = !is_full;
  Result<std::unique_ptr<Backend>> gl = CreateTunedGlBackend({}, tuning);
  DRAPE_CHECK(gl.ok(), gl.status().ToString());
  return std::move(gl).value();
}

ClothBatch BatchOf(const test::Scene& scene, const Skip& skip) {
  if (skip.is_tilted) return MakeBatch(scene, skip.cloths);
  return {scene, std::vector(skip.cloths, scene.parameters.gravity_m_per_s2)};
}

std::vector<Skip> AllSkips(Bench& bench, const SkipsOptions& options) {
  const Sheets sheets(options.side);
  std::vector<Skip> skips = Skips(sheets);
  const auto append = [&skips](std::vector<Skip> more) {
    skips.insert(skips.end(), more.begin(), more.end());
  };
  append(OfBackend(sheets, "cpu", options.cloths));
  append(LeavingOut(sheets, "cpu", options.cloths, kRest));
  const auto gl = std::ranges::find(bench.backends(), "gl", &NamedBackend::name);
  if (gl != bench.backends().end()) {
    const bool is_hardware = gl->backend->Describe().is_hardware_gpu;
    const uint32_t cloths = is_hardware ? options.cloths : kSoftwareCloths;
    append(OfBackend(sheets, "gl", cloths));
    append(LeavingOut(sheets, "gl", cloths, is_hardware ? kRest : kSoftwareRest));
    append({{.name = "lists of regular strips",
             .full = {sheets.hung},
             .lean = {sheets.hung},
             .backend = "gl",
             .cloths = cloths,
             .is_of_lists = true}});
  }
  for (Skip& skip : skips) {
    if (skip.backend.empty()) skip.backend = bench.fast_backend().name;
    if (skip.cloths == 0) skip.cloths = options.cloths;
  }
  return skips;
}

}  // namespace

void MeasureSkips(Bench& bench, SkipsOptions options) {
  if (bench.is_quick()) options = {.cloths = 2, .side = 6, .turns = 1, .steps = 2};
  Table table = bench.OpenTable("speed_skips", {"skip", "backend", "cloths", "particles", "full_ms",
                                                "lean_ms", "same_state"});
  for (const Skip& skip : AllSkips(bench, options)) {
    if (!bench.StartRow(skip.name)) return;
    Stepper full(BackendOf(skip, true), skip.full, BatchOf(skip.full.scene, skip));
    Stepper lean(BackendOf(skip, false), skip.lean, BatchOf(skip.lean.scene, skip));
    full.Step_ms(skip.lead_steps);
    lean.Step_ms(skip.lead_steps);
    std::vector<double> full_ms, lean_ms;
    for (uint32_t turn = 0; turn <= options.turns; ++turn) {
      const std::vector<double> of_full = full.Step_ms(options.steps);
      const std::vector<double> of_lean = lean.Step_ms(options.steps);
      if (turn == 0) continue;  // warms up
      full_ms.insert(full_ms.end(), of_full.begin(), of_full.end());
      lean_ms.insert(lean_ms.end(), of_lean.begin(), of_lean.end());
    }
    table.Add({skip.name, skip.backend, skip.cloths, options.side * options.side,
               Quantile(full_ms, 0.5), Quantile(lean_ms, 0.5), full.Bits() == lean.Bits()});
  }
}

}  // namespace drape::bench
