// End to end: clients that step their cloths over localhost, against the bare backend in the same
// run -> speed_service.csv.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/service_client.h"
#include "tests/bench/speed/speed.h"
#include "tests/support/backends.h"

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
  std::vector<double> bare_ms;    // of each step of all cloths on the bare backend
  std::vector<double> empty_ms;   // of requests without cloths, all clients at once
};

using Clients = std::span<const std::unique_ptr<ServiceClient>>;

// All clients at once, one request after the other, for `turn_s`: what `request` gave, of all.
template <class Request>
auto ServeTurn(Clients clients, double turn_s, Request request) {
  using Served = decltype(request(*clients[0]));
  std::vector<std::vector<Served>> served(clients.size());
  const auto start = WallClock::now();
  const auto run = [&](size_t k) {
    do {
      served[k].push_back(request(*clients[k]));
    } while (Since_ms(start) < 1000 * turn_s);
  };
  if (clients.size() == 1) {
    run(0);
  } else {
    std::vector<std::thread> threads;
    for (size_t k = 0; k < clients.size(); ++k) threads.emplace_back(run, k);
    for (std::thread& thread : threads) thread.join();
  }
  std::vector<Served> all;
  for (const std::vector<Served>& of_client : served) {
    all.insert(all.end(), of_client.begin(), of_client.end());
  }
  return all;
}

void StepTurn(Clients clients, bool wants_positions, double turn_s, ServiceTimes& times) {
  const auto start = WallClock::now();
  const auto steps = ServeTurn(clients, turn_s,
                               [&](ServiceClient& client) { return client.Step(wants_positions); });
  times.wall_ms += Since_ms(start);
  times.steps.insert(times.steps.end(), steps.begin(), steps.end());
}

// With pauses as long as the bare steps before.
void EmptyTurn(Clients clients, double turn_s, ServiceTimes& times) {
  const double pause_ms = Quantile(times.bare_ms, 0.5);
  const auto empty_ms = ServeTurn(
      clients, turn_s, [&](ServiceClient& client) { return client.StepNothing_ms(pause_ms); });
  times.empty_ms.insert(times.empty_ms.end(), empty_ms.begin(), empty_ms.end());
}

void BareTurn(BareCloths& bare, double turn_s, ServiceTimes& times) {
  const auto start = WallClock::now();
  do {
    times.bare_ms.push_back(bare.Step_ms());
  } while (Since_ms(start) < 1000 * turn_s);
}

void AddRow(Table& table, const std::string& backend, const ServiceLoad& load, uint32_t side,
            bool wants_positions, const ServiceTimes& times) {
  std::vector<double> wall_ms;
  for (const ServedStep& step : times.steps) wall_ms.push_back(step.wall_ms);
  const auto mean = [&](double ServedStep::*part) {
    double sum = 0;
    for (const ServedStep& step : times.steps) sum += step.*part;
    return sum / static_cast<double>(times.steps.size());
  };
  const double bare_ms = Quantile(times.bare_ms, 0.5);
  const double cloth_steps_per_s =
      1000 * static_cast<double>(times.steps.size()) * load.cloths / times.wall_ms;
  const std::string view = wants_positions ? "positions" : "acknowledgement";
  std::printf("    %-15s %9.0f cloth-steps/s, bare %9.0f  p50 %.3f ms p99 %.3f ms\n", view.c_str(),
              cloth_steps_per_s, 1000 * load.clients * load.cloths / bare_ms,
              Quantile(wall_ms, 0.5), Quantile(wall_ms, 0.99));
  table.Add({backend, load.clients, load.cloths, side * side, view, times.steps.size(),
             cloth_steps_per_s, Quantile(wall_ms, 0.5), Quantile(wall_ms, 0.99), bare_ms,
             mean(&ServedStep::wall_ms), mean(&ServedStep::queue_ms), mean(&ServedStep::upload_ms),
             mean(&ServedStep::device_ms), mean(&ServedStep::readback_ms),
             mean(&ServedStep::encode_ms), Quantile(times.empty_ms, 0.5)});
}

// The service and the bare backend in turn, a few times, so that what disturbs the machine disturbs
// both.
void MeasureLoad(Table& table, Service& service, const std::string& backend,
                 const ServiceLoad& load, const ServiceOptions& options) {
  std::vector<std::unique_ptr<ServiceClient>> clients;
  for (uint32_t k = 0; k < load.clients; ++k) {
    clients.push_back(service.Connect(options.side, load.cloths));
  }
  BareCloths bare(backend, options.side, load.clients * load.cloths);
  for (const bool wants_positions : {false, true}) {
    ServiceTimes times;
    for (uint32_t turn = 0; turn <= options.turns; ++turn) {
      if (turn == 1) times = {};  // the first one warmed up
      StepTurn(clients, wants_positions, options.turn_s, times);
      BareTurn(bare, options.turn_s, times);
      EmptyTurn(clients, options.turn_s / 4, times);
    }
    AddRow(table, backend, load, options.side, wants_positions, times);
  }
}

}  // namespace

void MeasureService(Bench& bench, ServiceOptions options) {
  if (bench.is_quick()) {
    options.loads = {{1, 2}, {2, 1}};
    options.side = 8;
    options.turn_s = 0.01;
    options.turns = 1;
  }
  Table table = bench.OpenTable(
      "speed_service", {"backend", "clients", "cloths", "particles", "view", "steps",
                        "cloth_steps_per_s", "p50_ms", "p99_ms", "bare_ms", "wall_ms", "queue_ms",
                        "upload_ms", "device_ms", "readback_ms", "encode_ms", "empty_ms"});
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
