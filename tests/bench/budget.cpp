// Frame budgets: whether steps keep to them, and what that leaves of the sweeps (section 3.5).
#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "server/scheduler/frame_budget.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {
namespace {

struct BudgetRow {
  std::vector<double> step_ms;
  std::vector<double> sweep_ms;  // of each step: its time / its sweeps
  std::vector<double> caps;
  uint32_t steps_over_budget = 0;  // with the warning
};

// The server's loop around one cloth: cap, step, measure.
BudgetRow Play(Backend& backend, const test::Scene& scene, uint32_t steps) {
  using Clock = std::chrono::steady_clock;
  FrameBudget budget;
  budget.Set(scene.parameters.settings);
  const ClothHandle cloth = test::CreateCloth(backend, scene);
  BudgetRow row;
  for (uint32_t step = 0; step < steps; ++step) {
    const StepItem item{
        .cloth = cloth, .pin_targets_m = {}, .measure = false, .max_iterations = budget.Cap()};
    const auto start = Clock::now();
    const StepReport done = backend.Step({&item, 1}).reports.at(0);
    const double step_us = std::chrono::duration<double, std::micro>(Clock::now() - start).count();
    const StepReport report = budget.Measured(done, step_us);
    row.step_ms.push_back(step_us / 1000);
    row.sweep_ms.push_back(step_us / 1000 / report.iterations);
    row.caps.push_back(report.iteration_cap);
    row.steps_over_budget += report.warnings.over_budget;
  }
  backend.Destroy(cloth);
  return row;
}

}  // namespace

void MeasureBudget(Bench& bench, BudgetOptions options) {
  if (bench.is_quick()) options = {.budgets_ms = {1}, .particles = 64, .steps = 20};
  Table table = bench.OpenTable(
      "budget", {"backend", "particles", "budget_ms", "steps", "median_ms", "p90_ms", "p99_ms",
                 "max_ms", "sweep_ms", "cap_median", "cap_min", "over_budget"});
  for (NamedBackend& named : bench.backends()) {
    for (const double budget_ms : options.budgets_ms) {
      if (!bench.StartRow(named.name + ", " + Cell(budget_ms).text() + " ms")) return;
      StepSettings settings = SettingsOf("PAPER");
      settings.tolerance = 0;  // every sweep that is allowed is done
      settings.frame_budget_ms = budget_ms;
      const test::Scene scene = Sheet(options.particles, Pins::kCorners, settings);
      const uint32_t steps = named.name == "gl" ? options.steps / 10 : options.steps;
      const BudgetRow row = Play(*named.backend, scene, steps);
      table.Add({named.name, options.particles, budget_ms, steps, Quantile(row.step_ms, 0.5),
                 Quantile(row.step_ms, 0.9), Quantile(row.step_ms, 0.99),
                 *std::max_element(row.step_ms.begin(), row.step_ms.end()),
                 Quantile(row.sweep_ms, 0.5), Quantile(row.caps, 0.5),
                 *std::min_element(row.caps.begin(), row.caps.end()), row.steps_over_budget});
    }
  }
}

}  // namespace drape::bench
