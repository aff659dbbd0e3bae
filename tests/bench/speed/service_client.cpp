#include "tests/bench/speed/service_client.h"

#include <absl/synchronization/mutex.h>

#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "drape/client.h"

namespace drape::bench {
namespace {

using WallClock = std::chrono::steady_clock;

double Elapsed_ms(WallClock::time_point start) {
  return std::chrono::duration<double, std::milli>(WallClock::now() - start).count();
}

double Milliseconds(uint64_t us) {
  return static_cast<double>(us) / 1000;
}

v1::ClothSpec HangingSpec(uint32_t side) {
  v1::ClothSpec spec;
  v1::Grid& grid = *spec.mutable_grid();
  grid.set_columns(side);
  grid.set_rows(side);
  grid.set_width_m(1);
  grid.set_height_m(1);
  spec.add_pins()->set_particle(0);
  spec.add_pins()->set_particle(side - 1);
  spec.mutable_settings()->set_sleep_motion_m(0);  // every step is computed
  return spec;
}

void SetView(StepView view, uint32_t side, v1::StepRequest& request) {
  if (view == StepView::kAcknowledgement) return;
  request.mutable_view()->set_positions(true);
  if (view == StepView::kPositions) return;
  for (const uint32_t corner : {0u, side - 1, side * (side - 1), side * side - 1}) {
    request.mutable_view()->add_particles(corner);
  }
}

ServedStep ToServedStep(double wall_ms, const v1::StepResponse& response) {
  if (!response.faulted_cloth_ids().empty()) {
    throw std::runtime_error("a cloth of the service has blown up");
  }
  const v1::StepTiming& timing = response.timing();
  return {wall_ms,
          Milliseconds(timing.queue_us()),
          Milliseconds(timing.upload_us()),
          Milliseconds(timing.device_us()),
          Milliseconds(timing.readback_us()),
          Milliseconds(timing.encode_us())};
}

class SessionClient final : public ServiceClient {
 public:
  SessionClient(const std::string& address, uint32_t side, uint32_t cloths)
      : client_(Client::Connect(address)),
        session_(client_.CreateSession()),
        empty_session_(client_.CreateSession()),
        side_(side) {
    session_.CreateCloths(HangingSpec(side), cloths);
  }

  std::vector<ServedStep> Steps(const Asking& asking,
                                const std::function<bool()>& is_over) override {
    v1::StepRequest request;
    request.set_all_cloths(true);
    request.set_steps(1);
    SetView(asking.view, side_, request);
    return asking.by_stream ? StepsByStream(request, asking.under_way, is_over)
                            : StepsByCalls(request, is_over);
  }

  double StepNothing_ms(double pause_ms) override {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(pause_ms));
    const auto start = WallClock::now();
    empty_session_.Step(1);
    return Elapsed_ms(start);
  }

 private:
  std::vector<ServedStep> StepsByCalls(const v1::StepRequest& request,
                                       const std::function<bool()>& is_over) {
    std::vector<ServedStep> steps;
    do {
      const auto start = WallClock::now();
      const v1::StepResponse response = session_.Step(request);
      steps.push_back(ToServedStep(Elapsed_ms(start), response));
    } while (!is_over());
    return steps;
  }

  std::vector<ServedStep> StepsByStream(const v1::StepRequest& request, uint32_t under_way,
                                        const std::function<bool()>& is_over) {
    std::vector<ServedStep> steps;
    StepStream stream = session_.OpenStepStream();
    auto before = WallClock::now();
    for (uint32_t k = 0; k < under_way; ++k) stream.Write(request);
    bool was_over = false;
    while (const std::optional<v1::StepResponse> response = stream.Read()) {
      const auto now = WallClock::now();
      steps.push_back(
          ToServedStep(std::chrono::duration<double, std::milli>(now - before).count(), *response));
      before = now;
      if (!was_over && is_over()) {
        stream.FinishWriting();
        was_over = true;
      }
      if (!was_over) stream.Write(request);
    }
    return steps;
  }

  Client client_;
  Session session_;
  Session empty_session_;
  const uint32_t side_;
};

class SpawnedService final : public Service {
 public:
  explicit SpawnedService(const SpawnOptions& options) : client_(Client::SpawnServer(options)) {}

  std::unique_ptr<ServiceClient> Connect(uint32_t side, uint32_t cloths) override {
    return std::make_unique<SessionClient>(client_.address(), side, cloths);
  }

 private:
  Client client_;
};

}  // namespace

std::unique_ptr<Service> StartService(const std::string& backend) {
  // As client/README.md recommends to programs that ask often.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  SpawnOptions options;
  options.backend = backend;
  return std::make_unique<SpawnedService>(options);
}

}  // namespace drape::bench
