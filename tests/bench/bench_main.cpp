// ./run bench: ms per step for each backend, against the number of cloths and against their size
// (the shape of figures 3b and 3c of Bender et al. 2009).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "server/core/log.h"
#include "tests/bench/step_bench.h"
#include "tests/support/backends.h"

namespace {

using drape::bench::MeasureSteps;
using drape::bench::StepCase;
using drape::bench::StepTimes;

struct Options {
  std::vector<std::string> backends = {"cpu", "gl", "reference"};
  std::vector<uint32_t> cloths = {1, 4, 16, 64};
  std::vector<uint32_t> sides = {8, 16, 32, 64, 128};
  std::string preset = "REALTIME";
  uint32_t warm_up = 3;
  uint32_t steps = 15;
  std::string csv;
};

drape::Preset PresetByName(const std::string& name) {
  if (name == "PAPER") return drape::Preset::kPaper;
  if (name == "ACCURATE") return drape::Preset::kAccurate;
  return drape::Preset::kRealtime;
}

void PrintHeader() {
  std::printf("%-10s %7s %10s %11s %9s %9s %9s %6s %7s %10s %12s\n", "backend", "cloths",
              "particles", "median ms", "min ms", "max ms", "device ms", "disp.", "sweeps",
              "max strain", "solves/s");
}

void Print(const std::string& backend, const StepCase& step_case, const StepTimes& times) {
  std::printf("%-10s %7u %10u %11.3f %9.3f %9.3f %9.3f %6u %7u %9.3f%% %12.3g\n", backend.c_str(),
              step_case.cloths, step_case.side * step_case.side, times.median_ms, times.min_ms,
              times.max_ms, times.device_ms, times.dispatches, times.iterations,
              100 * times.max_strain, times.solves_per_second);
  std::fflush(stdout);
}

void WriteCsvHeader(std::ostream& csv) {
  csv << "backend,preset,cloths,particles_per_cloth,median_ms,min_ms,max_ms,device_ms,dispatches,"
         "sweeps,max_strain,solves_per_second\n";
}

void WriteCsv(std::ostream& csv, const std::string& backend, const Options& options,
              const StepCase& step_case, const StepTimes& times) {
  csv << backend << ',' << options.preset << ',' << step_case.cloths << ','
      << step_case.side * step_case.side << ',' << times.median_ms << ',' << times.min_ms << ','
      << times.max_ms << ',' << times.device_ms << ',' << times.dispatches << ','
      << times.iterations << ',' << times.max_strain << ',' << times.solves_per_second << '\n';
  csv.flush();
}

void Run(const Options& options, std::ostream* csv) {
  std::vector<std::unique_ptr<drape::Backend>> backends;
  for (const std::string& name : options.backends) {
    backends.push_back(drape::test::MakeBackend(name));
    std::printf("%-10s %s\n", name.c_str(), backends.back()->Describe().device.c_str());
  }
  const drape::StepSettings settings = drape::PresetSettings(PresetByName(options.preset));
  std::vector<StepCase> cases;
  for (uint32_t count : options.cloths) cases.push_back({count, 32, settings});
  for (uint32_t side : options.sides) cases.push_back({1, side, settings});

  std::printf(
      "\n%s: %u substeps, at most %u iterations, tolerance %g, step 1/60 s; %u warm-up and %u "
      "timed steps\n\n",
      options.preset.c_str(), settings.substeps, settings.max_iterations, settings.tolerance,
      options.warm_up, options.steps);
  PrintHeader();
  for (const StepCase& step_case : cases) {
    for (size_t b = 0; b < backends.size(); ++b) {
      const StepTimes times = MeasureSteps(*backends[b], step_case, options.warm_up, options.steps);
      Print(options.backends[b], step_case, times);
      if (csv != nullptr) WriteCsv(*csv, options.backends[b], options, step_case, times);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Measures the time of a step on this machine, for each backend side by side."};
  app.add_option("--backends", options.backends, "cpu, gl, reference")
      ->delimiter(',')
      ->check(CLI::IsMember({"cpu", "gl", "reference"}));
  app.add_option("--cloths", options.cloths, "numbers of 1024-particle cloths")->delimiter(',');
  app.add_option("--sides", options.sides, "one cloth of side x side particles each")
      ->delimiter(',');
  app.add_option("--preset", options.preset, "step settings")
      ->check(CLI::IsMember({"PAPER", "REALTIME", "ACCURATE"}));
  app.add_option("--warm-up", options.warm_up, "steps before the timed ones");
  app.add_option("--steps", options.steps, "timed steps")->check(CLI::PositiveNumber);
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.option_defaults()->always_capture_default();
  CLI11_PARSE(app, argc, argv);

  if (const drape::Status status = drape::InitLog("warn"); !status.ok()) return 1;
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    if (!csv) {
      std::cerr << "cannot write --csv " << options.csv << "\n";
      return 1;
    }
    WriteCsvHeader(csv);
  }
  Run(options, options.csv.empty() ? nullptr : &csv);
  return 0;
}
