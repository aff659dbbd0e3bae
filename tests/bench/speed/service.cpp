// End to end: clients that step their cloths over localhost, against the bare backend in the same
// run -> speed_service.csv.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/service_client.h"
#include "tests/bench/speed/speed.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {
namespace {

using WallClock = std::chrono::steady_clock;

double Since_ms(WallClock::time_point start) {
  return std::chrono::duration<double, std::milli>(WallClock::now() - start).count();
}

// As many cloths on a backend of this process.
class BareCloths {
 public:
  BareCloths(const std::string& backend, uint32_t side, uint32_t cloths)
      : backend_(test::MakeBackend(backend)) {
    const ClothBatch batch =
        MakeBatch(Sheet(side * side, Pins::kCorners, PresetSettings(Preset::kRealtime)), cloths);
    for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
      test::Scene scene = batch.scene;
      scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
      items_.push_back({test::CreateCloth(*backend_, scene), {}, false});
    }
  }

  double Step_ms() {
    const auto start = WallClock::now();
    backend_->Step(items_);
    return Since_ms(start);
  }

 private:
  std::unique_ptr<Backend> backend_;
  std::vector<StepItem> items_;
};

struct ServiceTimes {
  std::vector<ServedStep> steps;  // of all clients
  double wall_ms = 0;             // of the turns of the service together
  std::vector<double> empty_ms;   // of requests without cloths, all clients at once
};

using Clients = std::span<const std::unique_ptr<ServiceClient>>;

// Runs all clients at once for `turn_s`; returns the results of serve(client, is_over) of all of
// them. `is_over` returns true when it is time to stop.
template <class Serve>
auto ServeTurn(Clients clients, double turn_s, Serve serve) {
  const auto start = WallClock::now();
  const std::function<bool()> is_over = [=] { return Since_ms(start) >= 1000 * turn_s; };
  using Served = decltype(serve(*clients[0], is_over));
  std::vector<Served> served(clients.size());
  const auto run = [&](size_t k) { served[k] = serve(*clients[k], is_over); };
  if (clients.size() == 1) {
    run(0);
  } else {
    std::vector<std::thread> threads;
    for (size_t k = 0; k < clients.size(); ++k) threads.emplace_back(run, k);
    for (std::thread& thread : threads) thread.join();
  }
  Served all;
  for (const Served& of_client : served) all.insert(all.end(), of_client.begin(), of_client.end());
  return all;
}

void StepTurn(Clients clients, const Asking& asking, double turn_s, ServiceTimes& times) {
  const auto start = WallClock::now();
  const auto steps = ServeTurn(clients, turn_s, [&](ServiceClient& client, const auto& is_over) {
    return client.Steps(asking, is_over);
  });
  times.wall_ms += Since_ms(start);
  times.steps.insert(times.steps.end(), steps.begin(), steps.end());
}

// With pauses as long as the bare steps.
void EmptyTurn(Clients clients, double turn_s, double pause_ms, ServiceTimes& times) {
  const auto empty_ms = ServeTurn(clients, turn_s, [&](ServiceClient& client, const auto& is_over) {
    std::vector<double> served_ms;
    do {
      served_ms.push_back(client.StepNothing_ms(pause_ms));
    } while (!is_over());
    return served_ms;
  });
  times.empty_ms.insert(times.empty_ms.end(), empty_ms.begin(), empty_ms.end());
}

void BareTurn(BareCloths& bare, double turn_s, std::vector<double>& bare_ms) {
  const auto start = WallClock::now();
  do {
    bare_ms.push_back(bare.Step_ms());
  } while (Since_ms(start) < 1000 * turn_s);
}

double Mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// The median of the means of eight successive steps: the time of a step when answers come in pairs,
// without the few that something else delayed.
double PerStep_ms(std::span<const double> steps_ms) {
  constexpr size_t kEight = 8;
  std::vector<double> means_ms;
  for (; !steps_ms.empty(); steps_ms = steps_ms.subspan(std::min(kEight, steps_ms.size()))) {
    if (steps_ms.size() < kEight && !means_ms.empty()) break;
    means_ms.push_back(Mean(steps_ms.first(std::min(kEight, steps_ms.size()))));
  }
  return Quantile(means_ms, 0.5);
}

std::string NameOf(StepView view) {
  switch (view) {
    case StepView::kAcknowledgement:
      return "acknowledgement";
    case StepView::kPositions:
      return "positions";
    case StepView::kCorners:
      return "corners";
  }
  return "";
}

void AddRow(Table& table, const std::string& backend, const ServiceLoad& load, uint32_t side,
            const Asking& asking, const ServiceTimes& times, std::span<const double> bare_ms) {
  std::vector<double> wall_ms;
  for (const ServedStep& step : times.steps) wall_ms.push_back(step.wall_ms);
  const auto mean = [&](double ServedStep::*part) {
    double sum = 0;
    for (const ServedStep& step : times.steps) sum += step.*part;
    return sum / static_cast<double>(times.steps.size());
  };
  const double cloth_steps_per_s =
      1000 * static_cast<double>(times.steps.size()) * load.cloths / times.wall_ms;
  const std::string view = NameOf(asking.view);
  const std::string call = asking.by_stream ? "StepStream" : "Step";
  std::printf(
      "    %-15s %-10s %u under way %9.0f cloth-steps/s, bare %9.0f  p50 %.3f ms p99 %.3f ms\n",
      view.c_str(), call.c_str(), asking.under_way, cloth_steps_per_s,
      1000 * load.clients * load.cloths / Mean(bare_ms), Quantile(wall_ms, 0.5),
      Quantile(wall_ms, 0.99));
  table.Add({backend,
             load.clients,
             load.cloths,
             side * side,
             view,
             call,
             asking.under_way,
             times.steps.size(),
             cloth_steps_per_s,
             Quantile(wall_ms, 0.5),
             Quantile(wall_ms, 0.99),
             PerStep_ms(wall_ms),
             Quantile(bare_ms, 0.5),
             PerStep_ms(bare_ms),
             Mean(bare_ms),
             mean(&ServedStep::wall_ms),
             mean(&ServedStep::queue_ms),
             mean(&ServedStep::upload_ms),
             mean(&ServedStep::device_ms),
             mean(&ServedStep::readback_ms),
             mean(&ServedStep::encode_ms),
             Quantile(times.empty_ms, 0.5)});
}

// One request at a time by both calls, two under way and the bare backend in turn, a few times, so
// that a disturbance of the machine affects all of them.
void MeasureLoad(Table& table, Service& service, const std::string& backend,
                 const ServiceLoad& load, const ServiceOptions& options) {
  std::vector<std::unique_ptr<ServiceClient>> clients;
  for (uint32_t k = 0; k < load.clients; ++k) {
    clients.push_back(service.Connect(options.side, load.cloths));
  }
  const bool are_several = load.clients > 1;
  const uint32_t turns = are_several ? options.turns_of_several : options.turns;
  const double turn_s = are_several ? options.turn_of_several_s : options.turn_s;
  BareCloths bare(backend, options.side, load.clients * load.cloths);
  for (const StepView view :
       {StepView::kAcknowledgement, StepView::kCorners, StepView::kPositions}) {
    const std::array<Asking, 3> askings = {{{view, false, 1}, {view, true, 1}, {view, true, 2}}};
    std::array<ServiceTimes, 3> times;
    std::vector<double> bare_ms;
    for (uint32_t turn = 0; turn <= turns; ++turn) {
      if (turn == 1) {  // the first one warmed up
        times = {};
        bare_ms.clear();
      }
      for (size_t k = 0; k < 3; ++k) StepTurn(clients, askings[k], turn_s, times[k]);
      BareTurn(bare, turn_s, bare_ms);
      EmptyTurn(clients, turn_s / 4, Quantile(bare_ms, 0.5), times[0]);
    }
    for (size_t k = 0; k < 3; ++k) {
      times[k].empty_ms = times[0].empty_ms;
      AddRow(table, backend, load, options.side, askings[k], times[k], bare_ms);
    }
  }
}

}  // namespace

void MeasureService(Bench& bench, ServiceOptions options) {
  if (bench.is_quick()) {
    options.loads = {{1, 2}, {2, 1}};
    options.side = 8;
    options.turn_s = options.turn_of_several_s = 0.01;
    options.turns = options.turns_of_several = 1;
  }
  Table table =
      bench.OpenTable("speed_service",
                      {"backend",   "clients",     "cloths",    "particles",         "view",
                       "call",      "under_way",   "steps",     "cloth_steps_per_s", "p50_ms",
                       "p99_ms",    "per_step_ms", "bare_ms",   "bare_per_step_ms",  "bare_mean_ms",
                       "wall_ms",   "queue_ms",    "upload_ms", "device_ms",         "readback_ms",
                       "encode_ms", "empty_ms"});
  const std::string backend = bench.fast_backend().name;
  const std::unique_ptr<Service> service = StartService(backend);
  for (const ServiceLoad& load : options.loads) {
    if (!bench.StartRow(std::to_string(load.clients) + " clients x " + std::to_string(load.cloths) +
                        " cloths")) {
      return;
    }
    MeasureLoad(table, *service, backend, load, options);
  }
}

}  // namespace drape::bench
