#include "tests/bench/accuracy/resting_scenes.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// Over the free particles and frames, the second difference of positions over frames: what an eye
// sees tremble, however slowly the whole cloth still moves [m].
struct Tremble {
  double rms_m = 0;
  double max_m = 0;
};

Tremble TrembleOf(const SceneModel& model, std::span<const ParticleState> states) {
  Tremble tremble;
  double sum_sq = 0, count = 0;
  for (size_t k = 2; k < states.size(); ++k) {
    for (uint32_t i = 0; i < model.particle_count(); ++i) {
      if (model.inverse_masses_per_kg()[i] == 0) continue;
      const double difference_m = (states[k].positions_m[i] - 2 * states[k - 1].positions_m[i] +
                                   states[k - 2].positions_m[i])
                                      .norm();
      tremble.max_m = std::max(tremble.max_m, difference_m);
      sum_sq += difference_m * difference_m;
      ++count;
    }
  }
  tremble.rms_m = std::sqrt(sum_sq / count);
  return tremble;
}

// A free motion dies out as exp(-c t / 2).
QuantityScene Resting(std::string name, test::Scene scene, bool is_quick) {
  scene.parameters.damping_per_s = 2;
  const auto model = scene.model;
  return {.name = std::move(name),
          .scene = std::move(scene),
          .duration_s = is_quick ? 0.1 : 13,
          .last_states = is_quick ? 4u : 62u,
          .quantities = {{"tremble RMS", "m",
                          [model](auto states) { return TrembleOf(*model, states).rms_m; }, 0.0},
                         {"tremble max", "m",
                          [model](auto states) { return TrembleOf(*model, states).max_m; }, 0.0}}};
}

// Falls from 1 cm above the collider, with friction.
test::Scene FallingOn(test::Scene scene, const Collider& collider) {
  scene.parameters.colliders = {collider};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.thickness_m = 0.002;
  return scene;
}

std::vector<uint32_t> FirstRow(uint32_t side) {
  std::vector<uint32_t> pins(side);
  for (uint32_t k = 0; k < side; ++k) pins[k] = k;
  return pins;
}

constexpr double kSlope_rad = 0.5;

enum class Kind { kGrid, kMesh, kParticles };

test::Scene Patch(Kind kind) {
  constexpr uint32_t kSide = 8;
  constexpr double kSize_m = 0.5;
  const test::Scene grid = test::Grid(kSide, kSide, kSize_m, kSize_m);
  if (kind == Kind::kGrid) return grid;
  if (kind == Kind::kMesh) return test::MeshedGrid(kSide, kSide, kSize_m, kSize_m);
  const auto masses_kg = grid.model->masses_kg();
  return test::Particles({grid.state.positions_m, {masses_kg.begin(), masses_kg.end()}, {}, {}});
}

// Mean way of the particles [m].
double MeanWay(const std::vector<Vector3d>& start_m, const std::vector<Vector3d>& end_m) {
  Vector3d sum = Vector3d::Zero();
  for (size_t i = 0; i < end_m.size(); ++i) sum += end_m[i] - start_m[i];
  return sum.norm() / static_cast<double>(end_m.size());
}

// `static_share`: static friction over the slope's; `dynamic_share`: dynamic over static friction.
QuantityScene OnSlope(Kind kind, double static_share, double dynamic_share, double distance_m) {
  static const std::string kNames[] = {"grid", "mesh", "particles"};
  test::Scene scene = Patch(kind);
  const Vector3d along(std::cos(kSlope_rad), -std::sin(kSlope_rad), 0);
  for (Vector3d& p : scene.state.positions_m) {
    p = (p.x() + distance_m) * along + Vector3d(0, 0, p.z());
  }
  ClothParameters& parameters = scene.parameters;
  parameters.colliders = {
      PlaneThrough(Vector3d::Zero(), {std::sin(kSlope_rad), std::cos(kSlope_rad), 0})};
  parameters.friction_static = static_share * std::tan(kSlope_rad);
  parameters.friction_dynamic = dynamic_share * parameters.friction_static;
  const auto text = [](double number) { return std::to_string(std::lround(100 * number)); };
  QuantityScene slope{.name = kNames[static_cast<size_t>(kind)] + " at " +
                              std::to_string(std::lround(distance_m)) + " m static " +
                              text(static_share) + " % dynamic " + text(dynamic_share) + " %",
                      .duration_s = 2};
  const auto way_m = [start_m = scene.state.positions_m](std::span<const ParticleState> states) {
    return MeanWay(start_m, states.back().positions_m);
  };
  if (static_share > 1) {
    slope.quantities = {{"creep", "m", way_m, 0.0}};
  } else {
    const double acceleration = parameters.gravity_m_per_s2.norm() * std::sin(kSlope_rad) *
                                (1 - static_share * dynamic_share);
    slope.duration_s = 1;
    slope.quantities = {{"slide", "m", way_m, acceleration / 2}};
  }
  slope.scene = std::move(scene);
  return slope;
}

}  // namespace

std::vector<QuantityScene> RestScenes(bool is_quick) {
  const uint32_t side = is_quick ? 6 : 24, last = side - 1;
  std::vector<QuantityScene> scenes;
  const auto add = [&](std::string name, test::Scene scene) {
    scenes.push_back(Resting(std::move(name), std::move(scene), is_quick));
  };
  add("three points", test::Grid(side, side, 1, 1, {0, side / 2, last}));
  add("two corners", test::Grid(side, side, 1, 1, {0, last}));
  if (is_quick) return scenes;
  add("first row", test::Grid(side, side, 1, 1, FirstRow(side)));
  add("first row of a long sheet", test::Grid(20, 50, 0.4, 1, FirstRow(20)));
  add("chain", test::Chain(32, 1.0 / 32, 0.01));
  add("net", test::Net(12, 0.08, 1e-5));
  // Slow by ACCURATE, which needs all its sweeps here.
  constexpr uint32_t kSmall = 16;
  const test::Scene grid = test::Grid(kSmall, kSmall, 1, 1);
  add("mesh", test::MeshedGrid(kSmall, kSmall, 1, 1, {0, kSmall - 1}));
  const Collider sphere = SphereAt({0.5, -0.31, 0.5}, 0.3);
  add("on a sphere", FallingOn(grid, sphere));
  add("mesh on a sphere", FallingOn(test::MeshedGrid(kSmall, kSmall, 1, 1), sphere));
  add("on a box", FallingOn(grid, BoxAt({0.5, -0.21, 0.5}, {0.3, 0.2, 0.2})));
  const Vector3d normal = Vector3d(0.3, 1, 0).normalized();
  add("on a slope", FallingOn(grid, PlaneThrough({0, -0.01, 0}, normal)));
  return scenes;
}

std::vector<QuantityScene> SlopeScenes(bool is_quick) {
  if (is_quick) return {OnSlope(Kind::kGrid, 1.02, 1, 0)};
  std::vector<QuantityScene> scenes;
  for (const Kind kind : {Kind::kGrid, Kind::kMesh, Kind::kParticles}) {
    for (const double static_share : {1.02, 0.98}) {
      for (const double distance_m : {0.0, 10.0, 100.0}) {
        for (const double dynamic_share : {0.5, 0.9, 1.0}) {
          if (kind != Kind::kGrid && dynamic_share == 1) continue;
          scenes.push_back(OnSlope(kind, static_share, dynamic_share, distance_m));
        }
      }
    }
  }
  return scenes;
}

}  // namespace drape::bench
