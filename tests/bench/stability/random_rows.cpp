#include "tests/bench/stability/random_rows.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "tests/stability/atlas/random_trial.h"

namespace drape::bench {
namespace {

using test::RandomKind;
using test::RandomTrial;

const std::vector<std::string> kRandomColumns = {
    "kind",       "backend", "method",     "cloths",  "duration_s", "largest_gain",
    "worst_seed", "gaining", "not_finite", "faulted", "warned",     "wall_s"};

struct Effort {
  uint64_t cloths = 43;
  double duration_s = 5;
};

void AddRow(Table& table, RandomKind kind, const std::string& backend, const std::string& method,
            const Effort& effort, const std::vector<RandomTrial>& trials, double wall_s) {
  const auto count = [&](auto&& is_so) { return std::ranges::count_if(trials, is_so); };
  const RandomTrial& worst = *std::ranges::max_element(trials, {}, &RandomTrial::largest_gain);
  const auto gaining =
      count([](const RandomTrial& one) { return !(one.largest_gain <= test::kMaxRandomGain); });
  const auto not_finite = count([](const RandomTrial& one) {
    return !one.is_finite || one.fault == FaultReason::kNotFinite;
  });
  const auto faulted =
      count([](const RandomTrial& one) { return one.fault != FaultReason::kNone; });
  const auto warned = count([](const RandomTrial& one) { return one.has_warned; });
  const std::string name(test::kRandomKindNames.at(static_cast<size_t>(kind)));
  table.Add({name, backend, method, trials.size(), effort.duration_s, worst.largest_gain,
             worst.seed, gaining, not_finite, faulted, warned, wall_s});
  std::printf(
      "    %-8s %-10s %zu cloths, gain %9.2g (seed %zu), %zu not finite, %zu warned, %.1f s\n",
      name.c_str(), method.c_str(), trials.size(), worst.largest_gain,
      static_cast<size_t>(worst.seed), static_cast<size_t>(not_finite), static_cast<size_t>(warned),
      wall_s);
}

}  // namespace

void MeasureRandomCloths(Bench& bench, const std::vector<test::AtlasMethod>& methods,
                         bool is_full) {
  Table table = bench.OpenTable("stability_random", kRandomColumns);
  for (size_t b = 0; b < bench.backends().size(); ++b) {
    NamedBackend& backend = bench.backends()[b];
    Effort effort;
    if (b > 0 && !is_full) effort = {.cloths = 4, .duration_s = 3};
    if (bench.is_quick()) effort = {.cloths = 1, .duration_s = 0.1};
    for (const test::AtlasMethod& method : methods) {
      if (b > 0 && !is_full && method.name != "REALTIME") continue;
      if (!bench.StartRow("random cloths, " + method.name + ", " + backend.name)) return;
      for (size_t kind = 0; kind < test::kRandomKindNames.size(); ++kind) {
        const auto start = std::chrono::steady_clock::now();
        const auto trials =
            test::TryRandomCloths(*backend.backend, static_cast<RandomKind>(kind), method.settings,
                                  1, effort.cloths, effort.duration_s);
        const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
        AddRow(table, static_cast<RandomKind>(kind), backend.name, method.name, effort, trials,
               wall.count());
      }
    }
  }
}

}  // namespace drape::bench
