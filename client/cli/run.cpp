// drape run: plays a scene file.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/output_file.h"
#include "client/cli/picture_flags.h"
#include "client/cli/progress.h"
#include "client/cli/run_scene.h"
#include "drape/scene_file.h"

namespace drape::cli {
namespace {

struct RunOptions {
  std::string scene;
  ServerOptions server;
  std::string compare;
  std::string report;
  std::vector<std::string> states;
  std::string render;
  PictureFlags picture;
  std::optional<uint64_t> every;
  std::vector<std::string> sets;
  std::optional<double> duration_s;
  bool has_summary = false;
  bool is_json = false;
  bool is_quiet = false;
};

v1::Scene Load(const RunOptions& options) {
  v1::Scene scene = LoadScene(options.scene, options.sets);
  if (options.duration_s) scene.set_duration_s(*options.duration_s);
  return scene;
}

void PrintText(const RunOptions& options, const RunReport& report, const Comparison* comparison) {
  const RunSummary summary = Summarise(report);
  if (!options.is_quiet) {
    std::printf("%s: %lu steps of %lu cloths (%lu particles) on %s (%s), %.3f ms per step\n",
                report.scene().c_str(), report.steps(), summary.cloths, summary.particles,
                report.backend().c_str(), report.device().c_str(), summary.ms_per_step);
    std::printf("%s", ImportLines(report).c_str());
  }
  if (options.has_summary) std::printf("%s", SummaryTable({report}).c_str());
  if (comparison == nullptr) return;
  const PositionDifference& difference = comparison->difference();
  const std::string up_to = ", compared up to step " + std::to_string(comparison->compared_steps());
  std::printf(
      "largest position difference of %s and %s: %.9g m (cloth %zu, particle %zu, step %lu)%s\n",
      report.backend().c_str(), comparison->backend().c_str(), difference.largest_m,
      difference.cloth, difference.particle, difference.step,
      comparison->compared_steps() < report.steps() ? up_to.c_str() : "");
}

nlohmann::ordered_json FaultsJson(const RunReport& report) {
  nlohmann::ordered_json faults = nlohmann::ordered_json::array();
  for (size_t k = 0; k < report.cloths().size(); ++k) {
    const std::optional<v1::StepReport>& fault = report.cloths()[k].fault;
    if (!fault) continue;
    faults.push_back(
        {{"cloth", k}, {"after_step", fault->step()}, {"reason", fault->fault_reason()}});
  }
  return faults;
}

void PrintJson(const RunReport& report, const Comparison* comparison) {
  const RunSummary summary = Summarise(report);
  nlohmann::ordered_json json = {{"scene", report.scene()},
                                 {"backend", report.backend()},
                                 {"device", report.device()},
                                 {"steps", report.steps()},
                                 {"cloths", summary.cloths},
                                 {"particles", summary.particles},
                                 {"constraints", summary.constraints},
                                 {"colours", summary.colours},
                                 {"wall_ms_per_step", report.wall_ms_per_step()},
                                 {"device_ms_per_step", report.device_ms_per_step()},
                                 {"real_time_factor", summary.real_time_factor},
                                 {"max_strain", summary.max_strain},
                                 {"rms_strain", summary.rms_strain},
                                 {"contacts", summary.contacts},
                                 {"faulted", summary.faulted},
                                 {"faults", FaultsJson(report)}};
  if (comparison != nullptr) {
    const PositionDifference& difference = comparison->difference();
    json["comparison"] = {
        {"backend", comparison->backend()}, {"largest_position_difference_m", difference.largest_m},
        {"cloth", difference.cloth},        {"particle", difference.particle},
        {"step", difference.step},          {"compared_steps", comparison->compared_steps()}};
  }
  std::cout << json.dump(1) << "\n";
}

int Run(const RunOptions& options) {
  const v1::Scene scene = Load(options);
  const uint64_t step_count = StepCount(scene);
  RunSinks sinks;
  // Opened first: a path that cannot be written should not cost a run.
  std::unique_ptr<OutputFile> report_file;
  if (!options.report.empty()) report_file = std::make_unique<OutputFile>(options.report);
  for (const std::string& path : options.states) {
    const bool is_series = options.every.has_value();
    sinks.writers.push_back(
        MakeStateWriter(path, {SceneTopologies(scene), scene.time_step_s(), is_series}));
  }
  if (!options.render.empty()) {
    sinks.pictures = std::make_unique<PictureSink>(options.render, options.every.has_value(),
                                                   options.picture.Request());
    sinks.has_contacts = options.picture.colour_by == "contact";
  }
  const Client client = options.server.Open();
  if (!options.compare.empty()) {
    sinks.comparison = std::make_unique<Comparison>(options.compare, scene);
  }
  const InterruptGuard interrupt;
  auto bar = std::make_unique<ProgressBar>(scene.name(), step_count, options.is_quiet);
  sinks.on_step = [&bar](uint64_t done) { bar->Show(done); };
  sinks.should_stop = [&interrupt] { return interrupt.is_interrupted(); };
  sinks.has_impulses = report_file != nullptr;
  const auto write_report = [&report_file](const RunReport& what_there_is) {
    if (!report_file) return;
    report_file->Write(ReportJson(what_there_is));
    report_file->Close();
  };
  sinks.on_failure = write_report;
  const RunReport report = RunScene(client, scene, options.every.value_or(1), sinks);
  bar.reset();

  write_report(report);
  const std::string faults = FaultLines(report);
  std::cerr << faults;
  if (options.is_json) {
    PrintJson(report, sinks.comparison.get());
  } else {
    PrintText(options, report, sinks.comparison.get());
  }
  if (report.steps() < step_count) {
    std::cerr << "drape: interrupted after step " << report.steps() << " of " << step_count << "\n";
    return kFailed;
  }
  return faults.empty() ? kDone : kFaulted;
}

// --set takes several values, so it may have taken the scene file after it, which has no "=".
void FindScene(RunOptions* options) {
  if (options->scene.empty() && !options->sets.empty() &&
      options->sets.back().find('=') == std::string::npos) {
    options->scene = options->sets.back();
    options->sets.pop_back();
  }
  if (options->scene.empty()) throw CLI::RequiredError("SCENE.json");
  for (const std::string& set : options->sets) {
    if (set.find('=') == std::string::npos || set.front() == '=') {
      throw CLI::ValidationError("--set", "\"" + set + "\" is not PATH=VALUE");
    }
  }
}

void CheckOutputs(const RunOptions& options) {
  std::error_code ignored;  // a path that cannot be read cannot be written either
  // Made absolute first: a relative path without an existing part would not be resolved.
  const auto place_of = [&](const std::string& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path), ignored);
  };
  std::vector<std::pair<std::string, std::string>> outputs;  // path, flag
  for (const std::string& path : options.states) outputs.emplace_back(path, "--states");
  if (!options.render.empty()) outputs.emplace_back(options.render, "--render");
  if (!options.report.empty()) outputs.emplace_back(options.report, "--report");
  std::map<std::filesystem::path, std::string> taken;
  for (const auto& [path, flag] : outputs) {
    const auto [other, is_free] = taken.emplace(place_of(path), flag);
    if (!is_free) {
      throw CLI::ValidationError(flag, path + " is also the file of " + other->second);
    }
  }
}

void AddOutputs(CLI::App& run, RunOptions* options) {
  run.add_option("--report", options->report, "Write the report of the run")->type_name("R.json");
  run.add_option("--states", options->states,
                 "Write states, by extension: .csv, .npz, .pc2 and .usda every sample\n"
                 "(.pc2 and .usda in single precision), .obj and .ply the last one, or with\n"
                 "--every=N a file per sample, S_000060.obj. May be given several times")
      ->allow_extra_args(false)
      ->check(StateFileValidator())
      ->type_name("FILE");
  CLI::Option* render =
      run.add_option("--render", options->render,
                     "Draw the last state, or with --every=N each sample: P_000060.png")
          ->check(PictureFileValidator())
          ->type_name("P.png");
  options->picture.AddTo(run, render);
  run.add_option("--every", options->every,
                 "A sample every N steps and after the last (default: 1)")
      ->check(CLI::Range(uint64_t{1}, uint64_t{1'000'000'000}))
      ->type_name("N");
  run.add_flag("--summary", options->has_summary, "Print a table of the results");
  run.add_flag("--json", options->is_json, "Print the result as JSON");
  run.add_flag("--quiet", options->is_quiet, "No progress bar, no closing line");
}

}  // namespace

void AddRun(CLI::App& app, Action& action) {
  CLI::App* run = app.add_subcommand("run", "Play a scene file");
  auto options = std::make_shared<RunOptions>();
  run->add_option("scene", options->scene, "The scene file")->type_name("SCENE.json");
  options->server.AddTo(*run);
  run->add_option("--compare", options->compare,
                  "Also play it on this backend; print the largest position difference")
      ->check(BackendNames())
      ->type_name("BACKEND");
  AddOutputs(*run, options.get());
  run->add_option("--set", options->sets,
                  "Set a field of every cloth's spec, e.g. settings.substeps=8")
      ->type_name("PATH=VALUE");
  run->add_option("--duration", options->duration_s,
                  "Play this long instead of the scene's duration [s]")
      ->check(CLI::Range(0.0, 1e6))
      ->check(FiniteNumber())
      ->type_name("S");
  run->callback([options, &action] {
    FindScene(options.get());
    CheckOutputs(*options);
    action = [options] { return Run(*options); };
  });
}

}  // namespace drape::cli
