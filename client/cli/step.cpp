// drape step: one Step request, or a run that the server paces.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

struct StepOptions {
  SessionFlags target;
  uint32_t steps = 1;
  uint64_t until = 0;
  bool is_real_time = false;
  double hz = 0;
  bool has_report = false;
  bool is_json = false;
};

void PrintReport(const v1::StepReport& report) {
  std::printf(
      "cloth %lu: step %lu, max strain %.4g, RMS strain %.4g, lowest %.4g m, %u contacts%s%s\n",
      report.cloth_id(), report.step(), report.max_strain(), report.rms_strain(), report.lowest_m(),
      report.contacts(), report.faulted() ? ", FAULTED: " : "", report.fault_reason().c_str());
}

// Until the steps are complete, or somebody ends this program: the server ends the run with it.
int Run(const StepOptions& options, bool has_end) {
  const Client client = options.target.address.Connect();
  Session session = options.target.Attach(client);
  v1::RunRequest::Start start;
  options.target.Select(&start);
  start.set_steps_hz(options.hz);
  if (has_end) start.set_max_steps(options.steps);
  RunStream run = session.Run(std::move(start));
  bool is_faulted = false;
  while (const std::optional<v1::RunReport> report = run.Next()) {
    is_faulted = report->faulted_cloths() > 0;
    if (options.is_json) {
      std::cout << MessageJson(*report) << std::flush;
      continue;
    }
    std::printf("%.1f s: %lu steps, %lu behind, %lu dropped, step %lu, %u of %u cloths faulted\n",
                report->elapsed_s(), report->steps(), report->steps_behind(),
                report->steps_dropped(), report->lowest_step(), report->faulted_cloths(),
                report->cloths());
    std::fflush(stdout);
  }
  return is_faulted ? kFaulted : kDone;
}

int Step(const StepOptions& options) {
  const Client client = options.target.address.Connect();
  Session session = options.target.Attach(client);
  v1::StepRequest request;
  options.target.Select(&request);
  if (options.until > 0) {
    request.set_until_step(options.until);
  } else {
    request.set_steps(options.steps);
  }
  request.set_report(options.has_report);
  const v1::StepResponse response = session.Step(request);
  const auto& faulted = response.faulted_cloth_ids();
  const int exit_code = faulted.empty() ? kDone : kFaulted;
  if (options.is_json) {
    std::cout << MessageJson(response);
    return exit_code;
  }
  const auto is_faulted = [&](ClothId id) {
    return std::find(faulted.begin(), faulted.end(), id) != faulted.end();
  };
  for (const v1::StepReport& report : response.reports()) PrintReport(report);
  for (int k = 0; !options.has_report && k < response.cloth_ids_size(); ++k) {
    std::printf("cloth %lu: step %lu%s\n", response.cloth_ids(k), response.steps(k),
                is_faulted(response.cloth_ids(k)) ? ", FAULTED" : "");
  }
  std::printf("device %.3f ms\n", static_cast<double>(response.timing().device_us()) * 1e-3);
  return exit_code;
}

}  // namespace

void AddStep(CLI::App& app, Action& action) {
  CLI::App* step = app.add_subcommand("step", "Step the cloths of a session");
  auto options = std::make_shared<StepOptions>();
  options->target.AddTo(*step);
  auto* steps = step->add_option("--steps", options->steps, "Number of steps (default: 1)");
  steps->check(CLI::PositiveNumber)->type_name("N");
  auto* until =
      step->add_option("--until", options->until, "Step until this many steps are complete");
  until->check(CLI::PositiveNumber)->type_name("N")->excludes(steps);
  auto* report =
      step->add_flag("--report", options->has_report, "Measure every cloth after the last step");
  auto* real_time = step->add_flag("--real-time", options->is_real_time,
                                   "The server steps in real time, for --steps or without end");
  real_time->excludes(until)->excludes(report);
  step->add_option("--hz", options->hz, "The same at so many steps per second")
      ->check(CLI::PositiveNumber)
      ->check(FiniteNumber())
      ->type_name("HZ")
      ->excludes(until)
      ->excludes(report)
      ->excludes(real_time);
  step->add_flag("--json", options->is_json, "Print JSON");
  step->callback([options, steps, &action] {
    const bool is_run = options->is_real_time || options->hz > 0;
    const bool has_end = steps->count() > 0;
    action = [options, is_run, has_end] {
      return is_run ? Run(*options, has_end) : Step(*options);
    };
  });
}

}  // namespace drape::cli
