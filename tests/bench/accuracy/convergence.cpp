#include "tests/bench/accuracy/convergence.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "server/core/check.h"
#include "tests/bench/accuracy/contestant.h"
#include "tests/bench/accuracy/deviations.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

constexpr double kUndefinedOrder = std::numeric_limits<double>::quiet_NaN();

// Sweeps until nothing changes: the rest is the error of the step.
constexpr char kTight[] = " max_iterations=5000 tolerance=1e-9";

StepSettings Settings(const std::string& words) {
  const Result<StepSettings> settings = ParseSettings(words);
  DRAPE_CHECK(settings.ok(), settings.status().ToString());
  return *settings;
}

ParticleState Play(Backend& backend, const AccuracyScene& scene, const StepSettings& settings,
                   Observer* observer = nullptr) {
  const auto contestant = MakeContestant(backend, scene.scene, settings);
  if (observer != nullptr) observer->Observe(0, contestant->State());
  for (uint32_t frame = 1; frame <= scene.frame_count(); ++frame) {
    contestant->Step();
    if (observer != nullptr) observer->Observe(frame, contestant->State());
  }
  return contestant->State();
}

void MeasureOrderOf(Bench& bench, Table& table, NamedBackend& named, const AccuracyScene& scene,
                    const std::string& method, const std::string& words) {
  if (!bench.StartRow("order: " + scene.name + ", " + named.name + ", " + method)) return;
  const std::vector<Vector3d> exact_m = scene.reference().positions_m;
  double before_m = kUndefinedOrder;
  for (const uint32_t substeps : {4u, 8u, 16u, 32u, 64u}) {
    const StepSettings settings = Settings(words + " substeps=" + std::to_string(substeps));
    const ParticleState end = Play(*named.backend, scene, settings);
    const PositionError error = ComparePositions(*scene.scene.model, end.positions_m, exact_m);
    table.Add({scene.name, named.name, method, substeps, settings.substep_s(), error.rms_m,
               error.max_m, std::log2(before_m / error.rms_m)});
    before_m = error.rms_m;
  }
}

void MeasureOrders(Bench& bench) {
  const bool is_quick = bench.is_quick();
  Table table =
      bench.OpenTable("accuracy_order", {"scene", "backend", "method", "substeps", "substep_s",
                                         "rms_position_m", "max_position_m", "order"});
  const std::vector<AccuracyScene> own = {PendulumScene(), ChainScene(is_quick),
                                          SwingScene(is_quick ? 6 : 32, is_quick)};
  for (const AccuracyScene& scene : own) {
    MeasureOrderOf(bench, table, bench.backends()[0], scene, "ACCURATE", "preset=ACCURATE");
  }
  const std::vector<AccuracyScene> small = {PendulumScene(), ChainScene(is_quick),
                                            SwingScene(is_quick ? 4 : 12, is_quick)};
  for (const AccuracyScene& scene : small) {
    MeasureOrderOf(bench, table, bench.reference(), scene, "ACCURATE tight",
                   std::string("preset=ACCURATE") + kTight);
  }
}

void MeasureEnergies(Bench& bench) {
  Table table = bench.OpenTable("accuracy_energy",
                                {"scene", "backend", "method", "duration_s", "energy_drift"});
  const bool is_quick = bench.is_quick();
  const uint32_t side = is_quick ? 4 : 16;
  for (AccuracyScene& scene : std::vector{
           PendulumScene(), ChainScene(is_quick), CurtainColumnScene(side, is_quick),
           SwingScene(side, is_quick), CurtainScene(side, is_quick), TwoCornersScene(side, 10)}) {
    if (!bench.StartRow("energy: " + scene.name)) return;
    scene.duration_s = is_quick ? 0.5 : 10;
    for (const Method& method : MethodsFor(scene.scene, PointGrid::kPresets)) {
      NamedBackend& named = bench.backends()[0];
      const std::vector<Vector3d> no_reference;  // outlives the observer
      Observer observer(scene, no_reference);
      Play(*named.backend, scene, method.settings, &observer);
      table.Add(
          {scene.name, named.name, method.name, scene.duration_s, observer.Result().energy_drift});
    }
  }
}

void MeasureSplit(Bench& bench) {
  Table table = bench.OpenTable("accuracy_split", {"scene", "method", "substeps", "sweeps",
                                                   "algebraic_m", "discretisation_m", "total_m"});
  const bool is_quick = bench.is_quick();
  Backend& backend = *bench.reference().backend;
  for (const AccuracyScene& scene :
       {CurtainColumnScene(is_quick ? 8 : 32, is_quick), SwingScene(is_quick ? 4 : 12, is_quick)}) {
    const std::vector<Vector3d> exact_m = scene.reference().positions_m;
    const SceneModel& model = *scene.scene.model;
    for (const std::string& words : SwitchesOfFamilies()) {
      if (words.find("use_tethers=true") != std::string::npos)
        continue;  // no tight limit of its own
      if (!bench.StartRow("split: " + scene.name + ", " + words)) return;
      for (const uint32_t substeps : {1u, 4u, 16u, 60u}) {
        const std::string step = words + " substeps=" + std::to_string(substeps);
        const auto tight_m = Play(backend, scene, Settings(step + kTight)).positions_m;
        const double discretisation_m = ComparePositions(model, tight_m, exact_m).rms_m;
        for (const uint32_t sweeps : {1u, 2u, 10u, 100u}) {
          const StepSettings settings =
              Settings(step + " tolerance=0 max_iterations=" + std::to_string(sweeps));
          const auto end_m = Play(backend, scene, settings).positions_m;
          table.Add({scene.name, words, substeps, sweeps,
                     ComparePositions(model, end_m, tight_m).rms_m, discretisation_m,
                     ComparePositions(model, end_m, exact_m).rms_m});
        }
      }
    }
  }
}

// A patch of 4 x 4 particles on an incline of 0.3 under friction of 0.5: nothing should move.
AccuracyScene StickingPatch() {
  AccuracyScene scene{.name = "sticking_patch",
                      .title = "a patch on an incline it sticks to",
                      .scene = test::Grid(4, 4, 0.1, 0.1)};
  const Eigen::AngleAxisd tilt(std::atan(0.3), Vector3d::UnitZ());
  for (Vector3d& p : scene.scene.state.positions_m) p = tilt * p;
  ClothParameters& parameters = scene.scene.parameters;
  parameters.colliders = {PlaneThrough(Vector3d::Zero(), tilt * Vector3d::UnitY())};
  parameters.friction_static = 0.5;
  parameters.friction_dynamic = 0.4;
  scene.duration_s = 10;
  return scene;
}

void MeasureCreep(Bench& bench) {
  Table table = bench.OpenTable("accuracy_creep", {"backend", "method", "duration_s", "creep_m"});
  AccuracyScene scene = StickingPatch();
  if (bench.is_quick()) scene.duration_s = 0.5;
  if (!bench.StartRow("creep")) return;
  for (const Method& method : MethodsFor(scene.scene, PointGrid::kPresets)) {
    NamedBackend& named = bench.backends()[0];
    const auto end_m = Play(*named.backend, scene, method.settings).positions_m;
    table.Add({named.name, method.name, scene.duration_s,
               ComparePositions(*scene.scene.model, end_m, scene.scene.state.positions_m).max_m});
  }
}

}  // namespace

void MeasureConvergence(Bench& bench) {
  MeasureOrders(bench);
  MeasureEnergies(bench);
  MeasureCreep(bench);
  MeasureSplit(bench);
}

}  // namespace drape::bench
