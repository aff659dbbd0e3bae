// What bodies that touch and hang together cost: contacts and joints are solved all at once.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/subcommands.h"
#include "tests/support/bodies.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// With a particle far from everything.
test::Scene Empty() {
  test::Scene scene = test::Particles({.positions_m = {Vector3d(0, 0, 100)},
                                       .masses_kg = {0.1},
                                       .distance_constraints = {},
                                       .springs = {}});
  scene.parameters.settings = SettingsOf("REALTIME");
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  return scene;
}

Collider Cube(const Vector3d& centre_m) {
  Collider cube = BoxAt(centre_m, Vector3d::Constant(0.05));
  cube.mass_kg = 1;
  return cube;
}

test::Scene OnFloor(const Collider& collider, const Vector3d& velocity = Vector3d::Zero()) {
  test::Scene scene = Empty();
  test::AddBody(scene, collider, velocity);
  test::AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  return scene;
}

// Upright on a rim of 16 points.
Collider Can() {
  Collider can = CylinderBetween({0, 0, 0}, {0, 0.1, 0}, 0.04);
  can.mass_kg = 1;
  return can;
}

// Columns of cubes, each a little off the one below: they lean, and fall.
test::Scene Pile(uint32_t cubes) {
  test::Scene scene = Empty();
  for (uint32_t k = 0; k < cubes; ++k) {
    test::AddBody(scene, Cube({0.02 * (k % 3), 0.06 + 0.11 * k, 0.015 * (k % 2)}));
  }
  test::AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  return scene;
}

// Straight columns, apart: they rest.
test::Scene Towers(uint32_t cubes) {
  test::Scene scene = Empty();
  for (uint32_t k = 0; k < cubes; ++k) {
    test::AddBody(scene, Cube({0.3 * (k / 4), 0.05 + 0.1 * (k % 4), 0}));
  }
  test::AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
  return scene;
}

// From the horizontal, 10 g per link, 1 kg at the end.
test::Scene Chain(uint32_t links) {
  test::Scene scene = Empty();
  for (uint32_t k = 0; k < links; ++k) {
    Collider link = CapsuleBetween({0.1 * k, 3, 0}, {0.1 * k + 0.1, 3, 0}, 0.005);
    link.mass_kg = k + 1 < links ? 0.01 : 1;
    test::AddBody(scene, link);
    test::Join(scene, k, {0.1 * k, 3, 0}, k == 0 ? std::nullopt : std::optional(k - 1));
  }
  return scene;
}

// Cubes that are tied to so many others each, most of which say a thing more than once.
test::Scene Lattice(uint32_t cubes, uint32_t joints_of_each) {
  test::Scene scene = Empty();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> off(-0.05, 0.05);
  const auto centre = [](uint32_t k) { return Vector3d(0.3 * (k % 4), 2 + 0.3 * (k / 4), 0); };
  for (uint32_t k = 0; k < cubes; ++k) test::AddBody(scene, Cube(centre(k)));
  for (uint32_t k = 0; k < cubes; ++k) {
    for (uint32_t j = 1; j <= joints_of_each; ++j) {
      const double x = off(random), y = off(random), z = off(random);
      test::Join(scene, k, centre(k) + Vector3d(x, y, z), (k + j) % cubes);
    }
  }
  return scene;
}

struct Case {
  std::string name;
  test::Scene scene;
};

std::vector<Case> Cases() {
  return {{"box_flies", OnFloor(Cube({0, 100, 0}))},
          {"box_rests", OnFloor(Cube({0, 0.05, 0}))},
          {"box_slides", OnFloor(Cube({0, 0.05, 0}), {8, 0, 0})},
          {"can_stands", OnFloor(Can())},
          {"towers_8", Towers(8)},
          {"towers_16", Towers(16)},
          {"pile_8", Pile(8)},
          {"pile_16", Pile(16)},
          {"chain_16", Chain(16)},
          {"lattice_16", Lattice(16, 8)}};
}

}  // namespace

void MeasureBodies(Bench& bench, BodiesOptions options) {
  using Clock = std::chrono::steady_clock;
  if (bench.is_quick()) options.steps = 2;
  Table table = bench.OpenTable(
      "bodies", {"scene", "bodies", "joints", "backend", "steps", "median_ms", "p90_ms", "max_ms"});
  for (const Case& one : Cases()) {
    if (!options.scenes.empty() &&
        std::ranges::find(options.scenes, one.name) == options.scenes.end()) {
      continue;
    }
    size_t bodies = 0, joints = 0;
    for (const Collider& collider : one.scene.parameters.colliders) {
      bodies += collider.is_body();
      joints += collider.joints.size();
    }
    for (NamedBackend& named : bench.backends()) {
      if (named.name.starts_with("gl")) continue;  // leaves bodies to cpu
      if (!bench.StartRow(one.name + ", " + named.name)) return;
      const ClothHandle cloth = test::CreateCloth(*named.backend, one.scene);
      const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
      std::vector<double> step_ms;
      for (uint32_t step = 0; step < options.steps; ++step) {
        const auto start = Clock::now();
        named.backend->Step({&item, 1});
        step_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
      }
      named.backend->Destroy(cloth);
      const double most_ms = *std::ranges::max_element(step_ms);
      table.Add({one.name, bodies, joints, named.name, options.steps, Quantile(step_ms, 0.5),
                 Quantile(step_ms, 0.9), most_ms});
      std::printf("  median %.3g ms, at most %.3g ms\n", Quantile(step_ms, 0.5), most_ms);
    }
  }
}

}  // namespace drape::bench
