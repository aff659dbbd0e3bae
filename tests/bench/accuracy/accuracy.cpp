// METHOD of the work-precision diagrams: wall time against error, per scene, method and setting.
#include "tests/bench/accuracy/accuracy.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <stdexcept>

#include "tests/bench/accuracy/bullet_cloth.h"
#include "tests/bench/accuracy/convergence.h"
#include "tests/bench/accuracy/plays.h"
#include "tests/bench/accuracy/quantities.h"

namespace drape::bench {
namespace {

const std::vector<std::string> kColumns = {"scene",
                                           "particles",
                                           "duration_s",
                                           "backend",
                                           "family",
                                           "method",
                                           "substeps",
                                           "sweeps",
                                           "settings",
                                           "status",
                                           "repeats",
                                           "wall_ms_per_s",
                                           "wall_min_ms_per_s",
                                           "wall_max_ms_per_s",
                                           "iterations_per_frame",
                                           "max_strain",
                                           "rms_strain",
                                           "rms_position_m",
                                           "max_position_m",
                                           "energy_drift",
                                           "max_penetration_m",
                                           "midpoint_penetration_m"};

// The named scenes, or all.
std::vector<AccuracyScene> ChosenScenes(const AccuracyOptions& options, bool is_quick) {
  std::vector<AccuracyScene> scenes = AccuracyScenes(is_quick);
  if (options.scenes.empty()) return scenes;
  std::vector<AccuracyScene> chosen;
  for (const std::string& name : options.scenes) {
    const auto found = std::find_if(scenes.begin(), scenes.end(),
                                    [&](const AccuracyScene& s) { return s.name == name; });
    if (found == scenes.end()) {
      std::string legal;
      for (const AccuracyScene& scene : scenes) legal += " " + scene.name;
      throw std::runtime_error("--scenes: '" + name + "' is none of" + legal);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

Entry MakeEntry(NamedBackend& named, const AccuracyScene& scene, const Method& method) {
  return {named.name, method, SettingsText(method.settings),
          MakeContestant(*named.backend, scene.scene, method.settings)};
}

// Everything on the first backend; the presets also on the others where the scene asks for it.
std::vector<Entry> EntriesFor(Bench& bench, const AccuracyScene& scene,
                              const std::vector<Method>& own) {
  std::vector<Entry> entries;
  const PointGrid points = bench.is_quick() ? PointGrid::kFew : scene.points;
  std::vector<Method> methods = MethodsFor(scene.scene, points);
  methods.insert(methods.end(), own.begin(), own.end());
  for (const Method& method : methods) {
    entries.push_back(MakeEntry(bench.backends()[0], scene, method));
  }
  if (scene.has_peer) {
    for (Entry& entry : BulletEntries(scene.scene, bench.is_quick())) {
      entries.push_back(std::move(entry));
    }
  }
  for (NamedBackend& named : bench.backends().subspan(1)) {
    if (!scene.all_backends && !bench.is_quick()) continue;
    for (const Method& method : MethodsFor(scene.scene, PointGrid::kPresets)) {
      entries.push_back(MakeEntry(named, scene, method));
    }
  }
  return entries;
}

void AddRow(Table& table, const AccuracyScene& scene, const Entry& entry,
            const PlayResult& result) {
  const Deviations& d = result.deviations;
  const StepSettings& settings = entry.method.settings;
  table.Add({scene.name,
             scene.scene.model->particle_count(),
             scene.duration_s,
             entry.program,
             entry.method.family,
             entry.method.name,
             settings.substeps,
             settings.max_iterations,
             entry.settings_text,
             result.status,
             result.repeats,
             result.wall_ms_per_s,
             result.wall_min_ms_per_s,
             result.wall_max_ms_per_s,
             result.iterations_per_frame,
             d.max_strain,
             d.rms_strain,
             d.rms_position_m,
             d.max_position_m,
             d.energy_drift,
             d.max_penetration_m,
             d.midpoint_penetration_m});
  std::printf("    %-9s %-28s %9.2f ms/s  strain %.2g %.2g  position %.2g  %s\n",
              entry.program.c_str(), entry.method.name.c_str(), result.wall_ms_per_s, d.max_strain,
              d.rms_strain, d.rms_position_m, result.status.c_str());
}

void AddReferenceRow(Table& table, const AccuracyScene& scene, const PositionReference& reference,
                     double took_s) {
  table.Add({scene.name, reference.solver, scene.duration_s, reference.step_s, reference.change_m,
             reference.error_m, took_s});
}

void MeasureScenes(Bench& bench, const AccuracyOptions& options) {
  std::vector<Method> own;
  for (const std::string& text : options.methods) own.push_back(ParseMethod(text));
  const std::vector<AccuracyScene> scenes = ChosenScenes(options, bench.is_quick());
  const PlayLimits limits = bench.is_quick()
                                ? PlayLimits{1, 0.05, std::max(60.0, options.limits.play_s)}
                                : options.limits;
  Table table = bench.OpenTable("accuracy", kColumns);
  Table references = bench.OpenTable("accuracy_references", {"scene", "solver", "time_s", "step_s",
                                                             "change_m", "error_m", "took_s"});
  for (const AccuracyScene& scene : scenes) {
    if (!bench.StartRow(scene.name + ": " + scene.title)) return;
    PositionReference reference;
    if (scene.reference) {
      const auto start = std::chrono::steady_clock::now();
      reference = scene.reference();
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      AddReferenceRow(references, scene, reference, took.count());
      std::printf("    reference: %s, error %.1e m, %.1f s\n", reference.solver.c_str(),
                  reference.error_m, took.count());
    }
    std::vector<Entry> entries = EntriesFor(bench, scene, own);
    const std::vector<PlayResult> results =
        PlaySideBySide(entries, scene, reference.positions_m, limits);
    for (size_t k = 0; k < entries.size(); ++k) AddRow(table, scene, entries[k], results[k]);
  }
}

}  // namespace

void MeasureAccuracy(Bench& bench, const AccuracyOptions& options) {
  const bool is_all = options.scenes.empty() && options.quantities.empty();
  if (is_all || !options.scenes.empty()) MeasureScenes(bench, options);
  if (is_all) MeasureConvergence(bench);
  if (is_all || !options.quantities.empty()) MeasureQuantities(bench, options.quantities);
}

}  // namespace drape::bench
