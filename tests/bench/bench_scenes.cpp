#include "tests/bench/bench_scenes.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "server/solver/load.h"

namespace drape::bench {

using Eigen::Vector3d;

std::string PinsName(Pins pins) {
  return pins == Pins::kCorners ? "corners" : "edge";
}

GridSides SidesOf(uint32_t particle_count) {
  auto rows = static_cast<uint32_t>(std::sqrt(particle_count));
  while (particle_count % rows != 0) --rows;
  return {particle_count / rows, rows};
}

test::Scene Sheet(uint32_t particle_count, Pins pins, const StepSettings& settings) {
  const GridSides sides = SidesOf(particle_count);
  std::vector<uint32_t> pinned = {0, sides.columns - 1};
  for (uint32_t i = 1; pins == Pins::kEdge && i + 1 < sides.columns; ++i) pinned.push_back(i);
  const double edge_m = 1.0 / (sides.columns - 1);
  test::Scene scene =
      test::Grid(sides.columns, sides.rows, 1, edge_m * (sides.rows - 1), std::move(pinned));
  scene.parameters.settings = settings;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);  // as the server does
  return scene;
}

test::Scene Figure4(uint32_t side, const StepSettings& settings) {
  test::Scene scene = test::Grid(side, side, 2, 2, {0, side - 1});
  scene.name = "figure_4";
  scene.parameters.colliders = {SphereAt(Vector3d(1, -0.7, 0.8), 0.4)};
  scene.parameters.damping_per_s = 0.2;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.settings = settings;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);  // as the server does
  return scene;
}

test::Scene Skirt(uint32_t around, uint32_t down, const StepSettings& settings) {
  constexpr double kWaist_m = 0.3;
  constexpr double kHem_m = 0.6;
  constexpr double kLength_m = 0.8;
  TriangleMesh mesh;
  for (uint32_t row = 0; row < down; ++row) {
    const double share = static_cast<double>(row) / (down - 1);
    const double radius_m = kWaist_m + (kHem_m - kWaist_m) * share;
    for (uint32_t k = 0; k < around; ++k) {
      const double turn = 2 * std::numbers::pi * k / around;
      mesh.positions_m.emplace_back(radius_m * std::cos(turn), -kLength_m * share,
                                    radius_m * std::sin(turn));
    }
  }
  for (uint32_t row = 0; row + 1 < down; ++row) {
    for (uint32_t k = 0; k < around; ++k) {
      const uint32_t a = row * around + k;
      const uint32_t b = row * around + (k + 1) % around;
      mesh.triangles.push_back({a, b, a + around});
      mesh.triangles.push_back({b, b + around, a + around});
    }
  }
  ModelDescription description{mesh, {}, {}};
  for (uint32_t k = 0; k < around; ++k) description.pinned_particles.push_back(k);
  test::Scene scene;
  scene.name = "skirt";
  scene.model = test::BuildModel(description);
  scene.state = test::RestState(*scene.model);
  scene.parameters.settings = settings;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);  // as the server does
  return scene;
}

StepSettings SettingsOf(const std::string& preset) {
  if (preset == "PAPER") return PresetSettings(Preset::kPaper);
  if (preset == "ACCURATE") return PresetSettings(Preset::kAccurate);
  return PresetSettings(Preset::kRealtime);
}

}  // namespace drape::bench
