#include "tests/bench/timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "tests/bench/quantiles.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

using Clock = std::chrono::steady_clock;

// The cloths of a batch on one backend, and what was measured of them.
class TimedBatch {
 public:
  TimedBatch(Backend& backend, const ClothBatch& batch) : backend_(backend), batch_(batch) {
    for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
      test::Scene scene = batch.scene;
      scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
      items_.push_back({test::CreateCloth(backend, scene), {}, false});
    }
  }
  ~TimedBatch() {
    for (const StepItem& item : items_) backend_.Destroy(item.cloth);
  }
  TimedBatch(const TimedBatch&) = delete;
  TimedBatch& operator=(const TimedBatch&) = delete;

  void WarmUp(uint32_t steps) {
    RaiseClocks(backend_, items_);
    for (uint32_t step = 0; step < steps; ++step) backend_.Step(items_);
  }

  bool IsDone(const TimingLimits& limits) const {
    return wall_ms_.size() >= limits.steps ||
           (wall_ms_.size() >= limits.min_steps && total_ms_ >= 1000 * limits.seconds);
  }

  void TimeStep() {
    const auto start = Clock::now();
    const BatchReport report = backend_.Step(items_);
    const std::chrono::duration<double, std::milli> wall = Clock::now() - start;
    wall_ms_.push_back(wall.count());
    total_ms_ += wall.count();
    device_ms_.push_back(static_cast<double>(report.device_us) / 1000);
    dispatches_ = report.dispatch_count;
    for (const StepReport& cloth : report.reports) iterations_ += cloth.iterations;
  }

  StepTimes Summary() {
    StepTimes times;
    times.steps = static_cast<uint32_t>(wall_ms_.size());
    times.median_ms = Quantile(wall_ms_, 0.5);
    times.p10_ms = Quantile(wall_ms_, 0.1);
    times.p90_ms = Quantile(wall_ms_, 0.9);
    times.min_ms = Quantile(wall_ms_, 0);
    times.max_ms = Quantile(wall_ms_, 1);
    times.device_ms = Quantile(device_ms_, 0.5);
    times.dispatches = dispatches_;
    const auto cloths = static_cast<double>(items_.size());
    times.iterations = iterations_ / cloths / times.steps;
    times.solves_per_second = cloths * batch_.scene.model->constraint_count() * times.iterations /
                              (times.median_ms / 1000);
    for (StepItem& item : items_) item.measure = true;
    for (const StepReport& cloth : backend_.Step(items_).reports) {
      if (cloth.fault != FaultReason::kNone) ++times.faulted;
      times.max_strain = std::max(times.max_strain, cloth.measured.max_strain);
      times.rms_strain = std::max(times.rms_strain, cloth.measured.rms_strain);
      times.contacts += cloth.measured.contacts;
    }
    return times;
  }

 private:
  Backend& backend_;
  const ClothBatch& batch_;
  std::vector<StepItem> items_;
  std::vector<double> wall_ms_;
  std::vector<double> device_ms_;
  double total_ms_ = 0;
  double iterations_ = 0;
  uint32_t dispatches_ = 0;
};

}  // namespace

void RaiseClocks(Backend& backend, std::span<const StepItem> items) {
  if (!backend.Describe().is_hardware_gpu) return;
  const auto end = Clock::now() + std::chrono::milliseconds(500);
  while (Clock::now() < end) backend.Step(items);
}

ClothBatch MakeBatch(test::Scene scene, uint32_t count) {
  ClothBatch batch{.scene = std::move(scene), .gravities_m_per_s2 = {}};
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  for (uint32_t k = 0; k < count; ++k) {
    const double tilt = 10 * std::numbers::pi / 180 * std::sqrt((k + 0.5) / count);
    const double turn = golden_angle * k;
    batch.gravities_m_per_s2.push_back(9.81 * Eigen::Vector3d(std::sin(tilt) * std::cos(turn),
                                                              -std::cos(tilt),
                                                              std::sin(tilt) * std::sin(turn)));
  }
  return batch;
}

std::vector<StepTimes> TimeSideBySide(std::span<NamedBackend> backends, const ClothBatch& batch,
                                      const TimingLimits& limits) {
  std::vector<std::unique_ptr<TimedBatch>> timed;
  for (NamedBackend& named : backends) {
    timed.push_back(std::make_unique<TimedBatch>(*named.backend, batch));
    timed.back()->WarmUp(limits.warm_up);
  }
  const auto is_done = [&](const auto& one) { return one->IsDone(limits); };
  while (!std::all_of(timed.begin(), timed.end(), is_done)) {
    for (const auto& one : timed) {
      if (!is_done(one)) one->TimeStep();
    }
  }
  std::vector<StepTimes> times;
  for (const auto& one : timed) times.push_back(one->Summary());
  return times;
}

PreparedScene Advance(Backend& backend, test::Scene scene, uint32_t steps) {
  const ClothHandle cloth = test::CreateCloth(backend, scene);
  double max_strain = 0;
  for (uint32_t step = 0; step < steps; ++step) {
    const StepReport report = test::StepAlone(backend, cloth, scene, 1, true);
    max_strain = std::max(max_strain, report.measured.max_strain);
  }
  scene.state = test::ReadState(backend, cloth);
  backend.Destroy(cloth);
  return {std::move(scene), max_strain};
}

}  // namespace drape::bench
