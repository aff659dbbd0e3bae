#include "tests/bench/step_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

namespace drape::bench {
namespace {

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

// Spread evenly over a cone of 10 degrees around -y (golden-angle spiral).
Eigen::Vector3d Gravity(uint32_t index, uint32_t count) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  const double tilt = 10 * std::numbers::pi / 180 * std::sqrt((index + 0.5) / count);
  const double turn = golden_angle * index;
  return 9.81 * Eigen::Vector3d(std::sin(tilt) * std::cos(turn), -std::cos(tilt),
                                std::sin(tilt) * std::sin(turn));
}

}  // namespace

StepTimes MeasureSteps(Backend& backend, const StepCase& step_case, uint32_t warm_up,
                       uint32_t steps) {
  const uint32_t side = step_case.side;
  ModelDescription description;
  description.topology = GridTopology{side, side, 1.0, 1.0};
  description.pinned_particles = {0, side - 1};
  const std::shared_ptr<const SceneModel> model = SceneModel::Build(description).value();
  ParticleState state;
  state.positions_m.assign(model->rest_positions_m().begin(), model->rest_positions_m().end());
  state.velocities_m_per_s.assign(model->particle_count(), Eigen::Vector3d::Zero());

  std::vector<StepItem> items(step_case.cloths);
  for (uint32_t k = 0; k < step_case.cloths; ++k) {
    ClothParameters parameters;
    parameters.settings = step_case.settings;
    parameters.gravity_m_per_s2 = Gravity(k, step_case.cloths);
    items[k].cloth = backend.Create(model, parameters, state).value();
  }

  std::vector<double> wall_ms;
  std::vector<double> device_ms;
  StepTimes times;
  for (uint32_t s = 0; s < warm_up + steps; ++s) {
    const bool is_last = s + 1 == warm_up + steps;
    const auto start = std::chrono::steady_clock::now();
    BatchReport report = backend.Step(items);
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
    if (s >= warm_up) {
      wall_ms.push_back(wall.count());
      device_ms.push_back(static_cast<double>(report.device_us) / 1000);
    }
    if (is_last) {
      times.dispatches = report.dispatch_count;
      times.iterations = report.reports.front().iterations;
    }
  }
  for (StepItem& item : items) item.measure = true;
  for (const StepReport& report : backend.Step(items).reports) {
    times.max_strain = std::max(times.max_strain, report.measured.max_strain);
  }
  for (const StepItem& item : items) backend.Destroy(item.cloth);

  times.median_ms = Median(wall_ms);
  times.min_ms = *std::min_element(wall_ms.begin(), wall_ms.end());
  times.max_ms = *std::max_element(wall_ms.begin(), wall_ms.end());
  times.device_ms = Median(device_ms);
  times.solves_per_second = static_cast<double>(model->constraint_count()) * times.iterations *
                            step_case.cloths / (times.median_ms / 1000);
  return times;
}

}  // namespace drape::bench
