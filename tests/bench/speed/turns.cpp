#include "tests/bench/speed/turns.h"

#include <chrono>
#include <utility>

#include "tests/bench/timing.h"

namespace drape::bench {

TurnTaker::TurnTaker(std::unique_ptr<Backend> backend, const test::Scene& start, uint32_t cloths)
    : backend_(std::move(backend)), particles_(start.model->particle_count()) {
  const ClothBatch batch = MakeBatch(start, cloths);
  for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
    test::Scene scene = batch.scene;
    scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
    items_.push_back({test::CreateCloth(*backend_, scene), {}, false});
  }
  RaiseClocks(*backend_, items_);
}

double TurnTaker::Turn_ms(double turn_s) {
  const auto start = std::chrono::steady_clock::now();
  uint32_t steps = 0;
  std::chrono::duration<double, std::milli> wall{};
  do {
    backend_->Step(items_);
    ++steps;
    wall = std::chrono::steady_clock::now() - start;
  } while (wall.count() < 1000 * turn_s);
  return wall.count() / steps;
}

}  // namespace drape::bench
