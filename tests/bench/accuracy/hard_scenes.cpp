#include "tests/bench/accuracy/hard_scenes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "tests/bench/accuracy/direct_solver.h"
#include "tests/support/obj_file.h"
#include "tests/support/paths/paths.h"
#include "tests/support/planar_chain.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

constexpr uint32_t kSide = 32;
constexpr double kTurn_rad = std::numbers::pi / 6;

AccuracyScene Hung(std::string name, std::string title, test::Scene sheet) {
  AccuracyScene scene{
      .name = std::move(name), .title = std::move(title), .scene = std::move(sheet)};
  scene.duration_s = 3;
  scene.window_start_s = 2;
  return scene;
}

// A sheet again as bare particles and constraints, with masses of its own.
test::Scene WithMasses(const test::Scene& sheet, std::vector<double> masses_kg) {
  ParticleTopology particles;
  particles.positions_m = sheet.state.positions_m;
  particles.masses_kg = std::move(masses_kg);
  const auto constraints = sheet.model->constraints();
  particles.distance_constraints.assign(constraints.begin(), constraints.end());
  const auto pins = sheet.model->pins();
  return test::Particles(particles, {pins.begin(), pins.end()});
}

std::vector<double> MassesOf(const test::Scene& sheet) {
  return {sheet.model->masses_kg().begin(), sheet.model->masses_kg().end()};
}

// By a factor of 10 from particle to particle, without a pattern along rows or columns.
std::vector<double> UnequalMasses(const test::Scene& sheet) {
  std::vector<double> masses_kg = MassesOf(sheet);
  for (size_t i = 0; i < masses_kg.size(); ++i) {
    const double share = static_cast<double>(i * 7919 % 101) / 100;  // in [0, 1]
    masses_kg[i] *= std::pow(10, share - 0.5);
  }
  return masses_kg;
}

AccuracyScene Turned() {
  test::Scene sheet = test::Grid(kSide, kSide, 1, 1, {0, kSide - 1});
  const Eigen::AngleAxisd turn(kTurn_rad, Vector3d::UnitY());
  for (Vector3d& p : sheet.state.positions_m) p = turn * p;
  return Hung("turned", "two_corners_32 turned by 30 degrees about the vertical", sheet);
}

// The threads of a square of 1 m run at 30 degrees to its sides: rows and columns of all lengths.
AccuracyScene BiasCut() {
  constexpr double kSpacing_m = 1.0 / (kSide - 1);
  constexpr int kReach = 2 * static_cast<int>(kSide);
  const Vector3d along = kSpacing_m * Vector3d(std::cos(kTurn_rad), 0, std::sin(kTurn_rad));
  const Vector3d across = kSpacing_m * Vector3d(-std::sin(kTurn_rad), 0, std::cos(kTurn_rad));
  const auto is_inside = [](const Vector3d& p) {
    return p.x() >= 0 && p.x() <= 1 && p.z() >= 0 && p.z() <= 1;
  };
  const auto at = [&](int a, int b) { return Vector3d(a * along + b * across); };
  std::vector<std::vector<uint32_t>> index(2 * kReach + 2,
                                           std::vector<uint32_t>(2 * kReach + 2, UINT32_MAX));
  const auto index_at = [&](int a, int b) -> uint32_t& {
    return index[static_cast<size_t>(a + kReach)][static_cast<size_t>(b + kReach)];
  };
  ParticleTopology particles;
  for (int b = -kReach; b < kReach; ++b) {
    for (int a = -kReach; a < kReach; ++a) {
      const bool has_neighbour = is_inside(at(a + 1, b)) || is_inside(at(a - 1, b)) ||
                                 is_inside(at(a, b + 1)) || is_inside(at(a, b - 1));
      if (!is_inside(at(a, b)) || !has_neighbour) continue;
      const auto i = static_cast<uint32_t>(particles.positions_m.size());
      index_at(a, b) = i;
      particles.positions_m.push_back(at(a, b));
      particles.masses_kg.push_back(0.2 * kSpacing_m * kSpacing_m);
      for (const uint32_t j : {index_at(a - 1, b), index_at(a, b - 1)}) {
        if (j != UINT32_MAX) particles.distance_constraints.push_back({j, i, kSpacing_m, 0});
      }
    }
  }
  const auto nearest = [&](const Vector3d& corner) {
    uint32_t best = 0;
    for (uint32_t i = 0; i < particles.positions_m.size(); ++i) {
      const auto distance = [&](uint32_t k) { return (particles.positions_m[k] - corner).norm(); };
      if (distance(i) < distance(best)) best = i;
    }
    return best;
  };
  const std::vector<uint32_t> pins = {nearest({0, 0, 0}), nearest({1, 0, 0})};
  return Hung("bias_cut", "a square cut at 30 degrees to its threads, two corners pinned",
              test::Particles(particles, pins));
}

AccuracyScene ThreePins() {
  return Hung("three_pins", "two corners and the middle of the far side pinned",
              test::Grid(kSide, kSide, 1, 1, {0, kSide - 1, kSide * (kSide - 1) + kSide / 2}));
}

AccuracyScene LPins() {
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < kSide; ++k) pins.push_back(k);
  for (uint32_t k = 1; k < kSide; ++k) pins.push_back(k * kSide);
  return Hung("l_pins", "first row and first column pinned", test::Grid(kSide, kSide, 1, 1, pins));
}

AccuracyScene Unequal() {
  const test::Scene sheet = test::Grid(kSide, kSide, 1, 1, {0, kSide - 1});
  return Hung("unequal_masses", "two corners; masses that differ by a factor of 10",
              WithMasses(sheet, UnequalMasses(sheet)));
}

AccuracyScene OddGrid() {
  return Hung("grid_45x27", "two corners; 45 x 27 particles",
              test::Grid(45, 27, 1, 26.0 / 44, {0, 44}));
}

AccuracyScene HeavyHem() {
  const test::Scene sheet = test::Grid(kSide, kSide, 1, 1, {0, kSide - 1});
  std::vector<double> masses_kg = MassesOf(sheet);
  for (uint32_t k = kSide * (kSide - 1); k < kSide * kSide; ++k) masses_kg[k] *= 100;
  return Hung("heavy_hem", "two corners; the last row 100 times as heavy",
              WithMasses(sheet, std::move(masses_kg)));
}

// The example scene, hanging: its pins do not move here.
AccuracyScene Skirt() {
  const std::filesystem::path folder = test::SourcePath("client/examples");
  std::ifstream file(folder / "skirt.json");
  if (!file) throw std::runtime_error("cannot read " + (folder / "skirt.json").string());
  const nlohmann::json spec = nlohmann::json::parse(file)["cloths"][0]["spec"];
  const nlohmann::json& material = spec["material"];
  ModelDescription description;
  description.topology =
      test::ReadObj(folder / spec["mesh_file"].get<std::string>(), spec["scale_m"]);
  description.material.areal_density_kg_per_m2 = material["areal_density_kg_per_m2"];
  description.material.bending_stiffness_n_per_m = material["bending_stiffness_n_per_m"];
  for (const nlohmann::json& pin : spec["pins"]) {
    description.pinned_particles.push_back(pin["particle"]);
  }
  test::Scene scene;
  scene.name = "skirt";
  scene.model = test::BuildModel(description);
  scene.state = test::RestState(*scene.model);
  scene.parameters.damping_per_s = material["damping_per_s"];
  return Hung("skirt", "client/examples/skirt.json: a mesh with springs, hung by its waist", scene);
}

}  // namespace

void HangAndPush(test::Scene& sheet, double turn_rad) {
  const Eigen::AngleAxisd turn(turn_rad, Vector3d::UnitY());
  for (size_t i = 0; i < sheet.state.positions_m.size(); ++i) {
    const Vector3d flat = sheet.state.positions_m[i];
    sheet.state.positions_m[i] = turn * Vector3d(flat.x(), -flat.z(), 0);
    const double speed = flat.z() * (0.7 + 0.3 * std::cos(std::numbers::pi * flat.x()));
    sheet.state.velocities_m_per_s[i] = turn * Vector3d(0, 0, speed);
  }
}

void SetDirectReference(AccuracyScene& scene) {
  // Finer steps only add round-off: 1e-9 m and better is reached here.
  constexpr double kSteps_per_s = 4000;
  constexpr double kTolerance_m = 1e-9;
  const auto steps = static_cast<uint32_t>(std::lround(kSteps_per_s * scene.duration_s));
  scene.reference = [scene = scene.scene, duration_s = scene.duration_s, steps] {
    ConvergedMotion motion =
        ConvergeDirect(scene.model, scene.state, scene.parameters.gravity_m_per_s2, duration_s,
                       steps, 4 * steps, kTolerance_m);
    return PositionReference{.positions_m = std::move(motion.positions_m),
                             .solver = "direct",
                             .step_s = motion.step_s,
                             .change_m = motion.change_m,
                             .error_m = motion.error_m};
  };
}

AccuracyScene HardSwing() {
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < 45; ++k) pins.push_back(k);
  test::Scene sheet = test::Grid(45, 27, 1, 26.0 / 44, pins);
  sheet = WithMasses(sheet, UnequalMasses(sheet));
  HangAndPush(sheet, kTurn_rad);
  AccuracyScene scene{.name = "swing_hard",
                      .title = "45 x 27 particles of unequal masses swing in a turned plane, 1 s",
                      .scene = std::move(sheet)};
  scene.length_m = 26.0 / 44;
  SetDirectReference(scene);
  return scene;
}

AccuracyScene Rope() {
  constexpr uint32_t kLinks = 64;
  constexpr double kMass_kg = 0.001;
  ParticleTopology particles;
  const test::PlanarChain straight = test::StraightChain(kLinks, 1.0 / kLinks, kMass_kg, 1);
  std::vector<test::PlanarChain::Link> links = straight.links();
  links.back().mass_kg *= 1000;
  const test::PlanarChain chain(links);
  particles.positions_m = chain.Positions_m();
  particles.masses_kg.assign(kLinks + 1, kMass_kg);
  particles.masses_kg.back() = links.back().mass_kg;
  for (uint32_t k = 0; k < kLinks; ++k) {
    particles.distance_constraints.push_back({k, k + 1, 1.0 / kLinks, 0});
  }
  AccuracyScene scene{.name = "rope",
                      .title = "64 links with a load 1000 times as heavy as one at the end, 1 s",
                      .scene = test::Particles(particles, {0})};
  scene.reference = [chain] {
    test::PlanarChain moving = chain;
    PositionReference reference{.positions_m = {}, .solver = "planar chain"};
    reference.error_m = moving.AdvanceConverged(1, 1e-8);
    reference.change_m = 15 * reference.error_m;
    reference.positions_m = moving.Positions_m();
    return reference;
  };
  return scene;
}

std::vector<AccuracyScene> HardScenes() {
  std::vector<AccuracyScene> scenes = {Turned(),  BiasCut(), ThreePins(), LPins(),
                                       Unequal(), OddGrid(), HeavyHem(),  Skirt()};
  return scenes;
}

}  // namespace drape::bench
