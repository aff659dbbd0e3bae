#include "tests/bench/speed/service_client.h"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "drape/client.h"

namespace drape::bench {
namespace {

using WallClock = std::chrono::steady_clock;

double Since_ms(WallClock::time_point start) {
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

class SessionClient final : public ServiceClient {
 public:
  SessionClient(const std::string& address, const v1::ClothSpec& spec, uint32_t cloths)
      : client_(Client::Connect(address)),
        session_(client_.CreateSession()),
        empty_session_(client_.CreateSession()) {
    session_.CreateCloths(spec, cloths);
  }

  ServedStep Step(bool wants_positions) override {
    v1::StepRequest request;
    request.set_steps(1);
    if (wants_positions) request.mutable_view()->set_positions(true);
    const auto start = WallClock::now();
    const v1::StepResponse response = session_.Step(std::move(request));
    const double wall_ms = Since_ms(start);
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

  double StepNothing_ms(double pause_ms) override {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(pause_ms));
    const auto start = WallClock::now();
    empty_session_.Step(1);
    return Since_ms(start);
  }

 private:
  Client client_;
  Session session_;
  Session empty_session_;
};

class SpawnedService final : public Service {
 public:
  explicit SpawnedService(const SpawnOptions& options) : client_(Client::SpawnServer(options)) {}

  std::unique_ptr<ServiceClient> Connect(uint32_t side, uint32_t cloths) override {
    return std::make_unique<SessionClient>(client_.address(), HangingSpec(side), cloths);
  }

 private:
  Client client_;
};

}  // namespace

std::unique_ptr<Service> StartService(const std::string& backend) {
  SpawnOptions options;
  options.backend = backend;
  return std::make_unique<SpawnedService>(options);
}

}  // namespace drape::bench
