// drape step: one Step request.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

struct StepOptions {
  SessionFlags target;
  uint32_t steps = 1;
  uint64_t until = 0;
  bool has_report = false;
  bool is_json = false;
};

void PrintReport(const v1::StepReport& report) {
  std::printf(
      "cloth %lu: step %lu, max strain %.4g, RMS strain %.4g, lowest %.4g m, %u contacts%s%s\n",
      report.cloth_id(), report.step(), report.max_strain(), report.rms_strain(), report.lowest_m(),
      report.contacts(), report.faulted() ? ", FAULTED: " : "", report.fault_reason().c_str());
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
  step->add_option("--until", options->until, "Step until this many steps are complete")
      ->check(CLI::PositiveNumber)
      ->type_name("N")
      ->excludes(steps);
  step->add_flag("--report", options->has_report, "Measure every cloth after the last step");
  step->add_flag("--json", options->is_json, "Print JSON");
  step->callback([options, &action] { action = [options] { return Step(*options); }; });
}

}  // namespace drape::cli
