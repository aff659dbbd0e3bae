#include "tests/bench/accuracy/resting_scenes.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tests/support/capstan.h"

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
  constexpr uint32_t kPatchSide = 8;
  constexpr double kSize_m = 0.5;
  const test::Scene grid = test::Grid(kPatchSide, kPatchSide, kSize_m, kSize_m);
  if (kind == Kind::kGrid) return grid;
  if (kind == Kind::kMesh) return test::MeshedGrid(kPatchSide, kPatchSide, kSize_m, kSize_m);
  const auto masses_kg = grid.model->masses_kg();
  return test::Particles({grid.state.positions_m, {masses_kg.begin(), masses_kg.end()}, {}, {}});
}

// Mean way of the particles [m].
double MeanWay(const std::vector<Vector3d>& start_m, const std::vector<Vector3d>& end_m) {
  Vector3d sum = Vector3d::Zero();
  for (size_t i = 0; i < end_m.size(); ++i) sum += end_m[i] - start_m[i];
  return sum.norm() / static_cast<double>(end_m.size());
}

// From the origin of the world. The server steps a cloth in a frame of its own, where it starts;
// one that was carried there has gone so far since.
struct Distance {
  double metres = 0;
  bool is_carried = false;
};

// `static_share`: static friction over the slope's; `dynamic_share`: dynamic over static friction.
QuantityScene OnSlope(Kind kind, double static_share, double dynamic_share,
                      const Distance& distance) {
  static const std::string kNames[] = {"grid", "mesh", "particles"};
  test::Scene scene = Patch(kind);
  const Vector3d along(std::cos(kSlope_rad), -std::sin(kSlope_rad), 0);
  const Vector3d there_m = distance.metres * along;
  const Vector3d origin_m = distance.is_carried ? Vector3d::Zero() : there_m;
  for (Vector3d& p : scene.state.positions_m) {
    p = p.x() * along + Vector3d(0, 0, p.z()) + (there_m - origin_m);
  }
  ClothParameters& parameters = scene.parameters;
  parameters.colliders = {PlaneThrough(-origin_m, {std::sin(kSlope_rad), std::cos(kSlope_rad), 0})};
  parameters.friction_static = static_share * std::tan(kSlope_rad);
  parameters.friction_dynamic = dynamic_share * parameters.friction_static;
  const auto text = [](double number) { return std::to_string(std::lround(100 * number)); };
  QuantityScene slope{.name = kNames[static_cast<size_t>(kind)] +
                              (distance.is_carried ? " carried " : " at ") +
                              std::to_string(std::lround(distance.metres)) + " m static " +
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

QuantityScene OverBar(uint32_t turns, double friction_static, double dynamic_share) {
  constexpr double kShare = 0.98;
  const test::CapstanBar bar{.turns = turns,
                             .hanging = 2,
                             .link_kg = 0.05,
                             .friction_static = friction_static,
                             .dynamic = dynamic_share};
  const auto text = [](double number) { return std::to_string(std::lround(100 * number)); };
  return {.name = std::to_string(turns) + " links static " + text(friction_static) + " % dynamic " +
                  text(dynamic_share) + " % of it",
          .scene = bar.Loaded(kShare, {}),
          .duration_s = 2,
          .last_states = static_cast<uint32_t>(std::lround(1 / kFrame_s)) + 1,
          .quantities = {{"sinks in a second", "m",
                          [](std::span<const ParticleState> states) {
                            return states.front().positions_m.back().y() -
                                   states.back().positions_m.back().y();
                          },
                          0.0}}};
}

// The ball starts so far above the sheet that it falls for a quarter of a second.
QuantityScene Catching(uint32_t side, double mass_ratio, double duration_s) {
  constexpr double kRadius_m = 0.15, kFall_m = 0.3;
  const uint32_t last = side - 1;
  test::Scene scene = test::Grid(side, side, 1, 1, {0, last, last * side, side * side - 1});
  double sheet_kg = 0;
  for (const double mass_kg : scene.model->masses_kg()) sheet_kg += mass_kg;
  Collider ball = SphereAt({0.5, kFall_m + kRadius_m, 0.5}, kRadius_m);
  ball.mass_kg = mass_ratio * sheet_kg;
  scene.parameters.colliders = {ball};
  scene.parameters.collider_motions = {RigidMotion::AtRest(CentreOf(ball))};
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  const auto largest = [model = scene.model](std::span<const ParticleState> states) {
    double strain = 0;
    for (const ParticleState& state : states) {
      for (const DistanceConstraint& link : model->constraints()) {
        const double length_m = (state.positions_m[link.i] - state.positions_m[link.j]).norm();
        strain = std::max(strain, std::abs(length_m / link.rest_length_m - 1));
      }
    }
    return strain;
  };
  return {.name = "ball of " + std::to_string(std::lround(100 * mass_ratio)) +
                  " % of the mass of " + std::to_string(side) + " x " + std::to_string(side),
          .scene = std::move(scene),
          .duration_s = duration_s,
          .last_states = static_cast<uint32_t>(std::lround(duration_s / kFrame_s)),
          .quantities = {{"largest strain", "-", largest, 0.0}}};
}

}  // namespace

std::vector<QuantityScene> CapstanScenes(bool is_quick) {
  if (is_quick) return {OverBar(6, 0.3, 1)};
  std::vector<QuantityScene> scenes;
  for (const uint32_t turns : {6u, 12u, 30u}) {
    for (const double friction_static : {0.2, 0.3, 0.45}) {
      for (const double dynamic_share : {0.7, 1.0}) {
        scenes.push_back(OverBar(turns, friction_static, dynamic_share));
      }
    }
  }
  return scenes;
}

std::vector<QuantityScene> CatchScenes(bool is_quick) {
  if (is_quick) return {Catching(6, 1, 0.1)};
  std::vector<QuantityScene> scenes;
  for (const uint32_t side : {16u, 32u}) {
    for (const double mass_ratio : {0.1, 0.3, 1.0, 3.0}) {
      scenes.push_back(Catching(side, mass_ratio, 2));
    }
  }
  return scenes;
}

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
  if (is_quick) return {OnSlope(Kind::kGrid, 1.02, 1, {})};
  std::vector<QuantityScene> scenes;
  for (const Kind kind : {Kind::kGrid, Kind::kMesh, Kind::kParticles}) {
    for (const double static_share : {1.02, 0.98}) {
      for (const Distance& distance :
           std::initializer_list<Distance>{{0}, {10}, {100}, {10, true}, {100, true}}) {
        for (const double dynamic_share : {0.5, 0.9, 1.0}) {
          if (kind != Kind::kGrid && dynamic_share == 1) continue;
          scenes.push_back(OnSlope(kind, static_share, dynamic_share, distance));
        }
      }
    }
  }
  return scenes;
}

}  // namespace drape::bench
