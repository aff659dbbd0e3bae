#include "tests/bench/accuracy/accuracy_scenes.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "tests/bench/accuracy/direct_solver.h"
#include "tests/bench/accuracy/hard_scenes.h"
#include "tests/support/planar_chain.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// Largest error of the exact chain: far below the resolution of single precision over a metre.
constexpr double kChainTolerance_m = 1e-8;

// The chain hangs from the particle `first` in the plane of `across` and y; particle `first + k *
// stride` is its k-th. Other particles are left where `positions_m` has them.
void PlaceChain(const std::vector<Vector3d>& chain, uint32_t first, uint32_t stride,
                const Vector3d& pivot_m, const Vector3d& across,
                std::vector<Vector3d>& positions_m) {
  for (uint32_t k = 0; k < chain.size(); ++k) {
    positions_m[first + k * stride] =
        pivot_m + chain[k].x() * across + chain[k].y() * Vector3d::UnitY();
  }
}

PositionReference ChainReference(
    test::PlanarChain chain, double duration_s,
    const std::function<std::vector<Vector3d>(const std::vector<Vector3d>&)>& place) {
  PositionReference reference{.positions_m = {}, .solver = "planar chain"};
  reference.error_m = chain.AdvanceConverged(duration_s, kChainTolerance_m);
  reference.change_m = 15 * reference.error_m;
  reference.positions_m = place(chain.Positions_m());
  return reference;
}

// A chain in the xy plane from the origin, its particles in order.
void SetChain(AccuracyScene& scene, const test::PlanarChain& chain) {
  scene.scene.state.positions_m = chain.Positions_m();
  scene.scene.state.velocities_m_per_s = chain.Velocities_m_per_s();
  scene.reference = [chain, duration_s = scene.duration_s] {
    return ChainReference(chain, duration_s, [](const auto& positions_m) { return positions_m; });
  };
}

// The same over a floor that it never touches: colliders keep a cloth from two steps.
AccuracyScene CurtainOverFloor(uint32_t side) {
  AccuracyScene scene = CurtainScene(side, false);
  scene.name = "curtain_over_floor_" + std::to_string(side);
  scene.title = "the curtain, with a floor 1 m below its lowest point";
  scene.scene.parameters.colliders = {PlaneThrough({0, -2, 0}, {0, 1, 0})};
  return scene;
}

AccuracyScene Sphere(uint32_t side, double duration_s) {
  AccuracyScene scene{.name = "sphere_" + std::to_string(side),
                      .title = "a sheet of 1 m falls onto a sphere of 0.3 m with friction",
                      .scene = test::FallingOnSphere(side)};
  scene.scene.parameters.colliders.resize(1);  // the sphere only
  scene.duration_s = duration_s;
  scene.window_start_s = std::max(0.0, duration_s - 1);
  scene.has_peer = true;
  return scene;
}

}  // namespace

uint32_t AccuracyScene::frame_count() const {
  return static_cast<uint32_t>(std::lround(duration_s / kFrame_s));
}

uint32_t AccuracyScene::window_start_frame() const {
  return static_cast<uint32_t>(std::lround(window_start_s / kFrame_s));
}

AccuracyScene PendulumScene() {
  AccuracyScene scene{.name = "pendulum",
                      .title = "one link of 1 m, let go at 2 rad, 2 s",
                      .scene = test::Chain(1, 1, 0.1)};
  scene.duration_s = 2;
  SetChain(scene, test::StraightChain(1, 1, 0.1, 2));
  return scene;
}

AccuracyScene ChainScene(bool is_quick) {
  constexpr uint32_t kLinks = 16;
  AccuracyScene scene{.name = "chain",
                      .title = "16 links, 1 m together, let go straight at 1 rad, 1 s",
                      .scene = test::Chain(kLinks, 1.0 / kLinks, 0.01)};
  scene.duration_s = is_quick ? 0.2 : 1;
  SetChain(scene, test::StraightChain(kLinks, 1.0 / kLinks, 0.01, 1));
  return scene;
}

AccuracyScene CurtainColumnScene(uint32_t rows, bool is_quick) {
  AccuracyScene scene{.name = "curtain_column",
                      .title = "one column of the curtain: a chain let go horizontally, 0.6 s",
                      .scene = test::Chain(rows - 1, 1.0 / (rows - 1), 0.01)};
  scene.duration_s = is_quick ? 0.1 : 0.6;
  SetChain(scene, test::StraightChain(rows - 1, 1.0 / (rows - 1), 0.01, std::numbers::pi / 2));
  return scene;
}

AccuracyScene CurtainScene(uint32_t side, bool is_quick) {
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < side; ++k) pins.push_back(k);
  AccuracyScene scene{.name = "curtain_" + std::to_string(side),
                      .title = "a sheet of 1 m, its first row pinned, let go horizontally, 0.6 s",
                      .scene = test::Grid(side, side, 1, 1, pins)};
  scene.duration_s = is_quick ? 0.1 : 0.6;
  scene.reference = [side, duration_s = scene.duration_s, rest = scene.scene.state.positions_m] {
    return ChainReference(test::CurtainColumn(side, 1), duration_s, [&](const auto& chain) {
      std::vector<Vector3d> positions_m = rest;
      for (uint32_t k = 0; k < side; ++k) {
        PlaceChain(chain, k, side, rest[k], Vector3d::UnitZ(), positions_m);
      }
      return positions_m;
    });
  };
  return scene;
}

AccuracyScene TwoCornersScene(uint32_t side, double duration_s) {
  AccuracyScene scene{.name = "two_corners_" + std::to_string(side),
                      .title = "a sheet of 1 m, two corners pinned, let go horizontally",
                      .scene = test::Grid(side, side, 1, 1, {0, side - 1})};
  scene.duration_s = duration_s;
  scene.window_start_s = std::max(0.0, duration_s - 1);
  scene.has_peer = true;
  return scene;
}

AccuracyScene SwingScene(uint32_t side, bool is_quick) {
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < side; ++k) pins.push_back(k);
  AccuracyScene scene{
      .name = "swing_" + std::to_string(side),
      .title = "a sheet of 1 m hangs by its first row and is pushed, one side more, 1 s",
      .scene = test::Grid(side, side, 1, 1, pins)};
  scene.duration_s = is_quick ? 0.1 : 1;
  HangAndPush(scene.scene, 0);
  SetDirectReference(scene);
  return scene;
}

std::vector<AccuracyScene> AccuracyScenes(bool is_quick) {
  if (is_quick) {
    return {PendulumScene(), CurtainScene(6, true), SwingScene(6, true), TwoCornersScene(6, 0.1),
            Sphere(9, 0.1)};
  }
  std::vector<AccuracyScene> scenes;
  for (AccuracyScene& scene : std::vector{PendulumScene(), ChainScene(false),
                                          CurtainScene(32, false), SwingScene(32, false)}) {
    scene.points = PointGrid::kFullAndFiner;
    scene.all_backends = scene.name == "curtain_32";
    scene.has_peer = scene.name == "curtain_32";
    scenes.push_back(std::move(scene));
  }
  for (AccuracyScene& scene : std::vector{CurtainOverFloor(32), TwoCornersScene(32, 5),
                                          Sphere(33, 2), HardSwing(), Rope()}) {
    scene.points = PointGrid::kFull;
    scenes.push_back(std::move(scene));
  }
  for (AccuracyScene& scene : std::vector{CurtainScene(128, false), TwoCornersScene(128, 3)}) {
    scene.points = PointGrid::kCoarse;
    scenes.push_back(std::move(scene));
  }
  for (AccuracyScene& scene : HardScenes()) scenes.push_back(std::move(scene));
  return scenes;
}

}  // namespace drape::bench
