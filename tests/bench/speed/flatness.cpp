// What a cloth costs among few and among many, and a particle in small cloths and in large ones:
// sizes in turn, round after round, so that what disturbs the machine disturbs all
// -> speed_flatness.csv.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/step_rows.h"
#include "tests/support/backends.h"

namespace drape::bench {
namespace {

// Cloths of one size, on a backend of their own.
class Contestant {
 public:
  Contestant(const std::string& backend, const test::Scene& start, uint32_t cloths)
      : backend_(test::MakeBackend(backend)), cloths_(cloths) {
    particles_ = start.model->particle_count();
    const ClothBatch batch = MakeBatch(start, cloths);
    for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
      test::Scene scene = batch.scene;
      scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
      items_.push_back({test::CreateCloth(*backend_, scene), {}, false});
    }
  }

  uint32_t cloths() const { return cloths_; }
  uint32_t particles() const { return particles_; }

  // Mean wall time of a step [ms], of at least one and of as many as take `turn_s`.
  double Turn_ms(double turn_s) {
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

 private:
  std::unique_ptr<Backend> backend_;
  uint32_t cloths_;
  uint32_t particles_ = 0;
  std::vector<StepItem> items_;
};

}  // namespace

void MeasureFlatness(Bench& bench, FlatnessOptions options) {
  if (bench.is_quick()) {
    options.counts = {1, 5};
    options.cloth_particles = 64;
    options.particles = {64, 128};
    options.rounds = 2;
    options.turn_s = 0.001;
  }
  Table table =
      bench.OpenTable("speed_flatness", {"along", "backend", "cloths", "particles", "round", "ms"});
  const std::string backend = bench.fast_backend().name;
  const auto measure = [&](const std::string& along, std::vector<Contestant>& contestants) {
    if (!bench.StartRow("flatness along the " + along)) return;
    for (uint32_t round = 0; round <= options.rounds; ++round) {
      for (Contestant& one : contestants) {
        const double ms = one.Turn_ms(options.turn_s);
        if (round == 0) continue;  // warmed up
        table.Add({along, backend, one.cloths(), one.particles(), round, ms});
      }
    }
  };
  std::vector<Contestant> contestants;
  const test::Scene small =
      MidSwing(bench, options.cloth_particles, Pins::kCorners, "REALTIME").scene;
  for (const uint32_t count : options.counts) contestants.emplace_back(backend, small, count);
  measure("cloths", contestants);
  contestants.clear();
  for (const uint32_t particles : options.particles) {
    const test::Scene start = MidSwing(bench, particles, Pins::kCorners, "REALTIME").scene;
    contestants.emplace_back(backend, start, 1);
  }
  measure("particles", contestants);
}

}  // namespace drape::bench
