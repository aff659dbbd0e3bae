#include "tests/support/reach_scenes.h"

#include <ostream>
#include <utility>
#include <variant>

namespace drape::test {
namespace {

using Eigen::Vector3d;

struct Size {
  uint32_t columns;
  uint32_t rows;
};

Scene Sheet(const std::string& name, Preset preset, Size size, std::vector<uint32_t> pins = {}) {
  return ReachSheet(name, preset, size.columns, size.rows, std::move(pins));
}

// Held together to this share of its size: it bursts within the first step.
void Squeeze(Scene& scene, double share) {
  const Vector3d middle(0.5, 0, 0.5);
  for (Vector3d& p : scene.state.positions_m) p = middle + share * (p - middle);
}

void AddFalls(std::vector<ReachCase>& cases, Size size) {
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    for (const bool moves : {false, true}) {
      for (const auto& [kind, collider] : EachKind(moves ? -0.75 : -0.55)) {
        const std::string suffix =
            "_" + kind + (moves ? "_moving" : "") + (preset == Preset::kPaper ? "_paper" : "");
        Scene scene = Sheet("fall" + suffix, preset, size);
        for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -3;
        scene.parameters.colliders = {collider};
        if (moves) {
          RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
          motion.velocity_m_per_s = {0.2, 1, 0};
          motion.angular_velocity_rad_per_s = {0, 0.5, 0.1};
          scene.parameters.collider_motions = {motion};
        }
        const bool fits_lanes = !moves && kind != "map";
        cases.push_back({.scene = scene, .steps = 13, .meets = true, .fits_lanes = fits_lanes});
      }
    }
  }
}

// 0.83 m per step: within reach before they touch, though nothing is near when they start.
void AddFastFalls(std::vector<ReachCase>& cases, Size size) {
  for (const auto& [kind, collider] : EachKind(-3)) {
    Scene scene = Sheet("fast_fall_" + kind, Preset::kRealtime, size);
    scene.parameters.settings.substeps = 4;
    for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -50;
    scene.parameters.colliders = {collider};
    cases.push_back({.scene = scene, .steps = 4, .meets = true, .fits_lanes = kind != "map"});
  }
}

void AddFarOnes(std::vector<ReachCase>& cases, Size size) {
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper, Preset::kAccurate}) {
    Scene scene = Sheet(std::string("hung_") + (preset == Preset::kRealtime ? "realtime"
                                                : preset == Preset::kPaper  ? "paper"
                                                                            : "accurate"),
                        preset, size, {0, size.columns - 1});
    if (preset == Preset::kAccurate) scene.parameters.settings.substeps = 8;
    for (const auto& [kind, collider] : EachKind(-20)) {
      if (kind != "map") scene.parameters.colliders.push_back(collider);
    }
    cases.push_back({.scene = scene, .steps = 3});
  }
  // Stages one by one, as elastic elements are between them.
  Scene bending = Grid(size.columns, size.rows, 1, 1, {0, size.columns - 1},
                       {.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20});
  bending.name = "hung_bending";
  bending.parameters.colliders = {Wall(30)};
  cases.push_back({.scene = bending, .steps = 3});
  // On the floor, with others before and after it that are far.
  Scene floor = Sheet("floor_among_far_ones", Preset::kRealtime, size);
  floor.parameters.colliders = {Wall(30), PlaneThrough({0, -0.005, 0}, {0, 1, 0}),
                                SphereAt({0.5, 8, 0.5}, 1)};
  cases.push_back({.scene = floor, .steps = 6, .meets = true});
  Scene moving = floor;
  moving.name = "moving_floor_among_far_ones";
  for (const Collider& collider : moving.parameters.colliders) {
    moving.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  moving.parameters.collider_motions[1].velocity_m_per_s.x() = 0.3;
  cases.push_back({.scene = moving, .steps = 6, .meets = true, .fits_lanes = false});
}

// A burst, which no speed predicts.
void AddBursts(std::vector<ReachCase>& cases, Size size) {
  std::vector<uint32_t> first_column;
  for (uint32_t row = 0; row < size.rows; ++row) first_column.push_back(row * size.columns);
  for (const uint32_t sweeps : {1u, 3u}) {
    const std::string suffix = sweeps == 1 ? "" : "_of_several_sweeps";
    Scene burst = Sheet("burst" + suffix, Preset::kRealtime, size);
    Squeeze(burst, 0.8);
    burst.parameters.settings.max_iterations = sweeps;
    burst.parameters.colliders = {Wall(0.96)};
    cases.push_back({.scene = burst, .meets = true, .repeats = true});
    // Only towards walls of which the nearer one takes all particles back before the sweep ends.
    Scene two_walls = Sheet("burst_at_two_walls" + suffix, Preset::kRealtime, size, first_column);
    for (Vector3d& p : two_walls.state.positions_m) p.x() *= 0.8;
    two_walls.parameters.settings.max_iterations = sweeps;
    two_walls.parameters.settings.substeps = 1;
    two_walls.parameters.gravity_m_per_s2 = {0, 0, 9.81};  // so that it does not buckle
    for (Vector3d& v : two_walls.state.velocities_m_per_s) v.x() = -0.5;  // a reach of 23 mm
    two_walls.parameters.colliders = {Wall(0.85), Wall(0.82)};
    cases.push_back({.scene = two_walls, .meets = true, .repeats = true});
    Scene moving = burst;
    moving.name = "burst_at_a_moving_wall" + suffix;
    moving.parameters.collider_motions = {RigidMotion::AtRest({0.96, 0, 0})};
    cases.push_back({.scene = moving, .meets = true, .repeats = true, .fits_lanes = false});
    Scene bending = Grid(size.columns, size.rows, 1, 1, {}, {.bending_rigidity_n_m = 1e-4});
    bending.name = "burst_of_a_stiff_sheet" + suffix;
    bending.parameters = burst.parameters;
    Squeeze(bending, 0.8);
    cases.push_back({.scene = bending, .meets = true, .repeats = true});
  }
  Scene explosive = ExplosiveSheet(size.rows);
  explosive.parameters.colliders = {Wall(30)};
  cases.push_back({.scene = explosive, .repeats = true});
}

}  // namespace

void PrintTo(const ReachCase& one, std::ostream* stream) {
  *stream << one.scene.name;
}

std::vector<ReachCase> ReachCases(uint32_t columns, uint32_t rows) {
  const Size size{columns, rows};
  std::vector<ReachCase> cases;
  AddFalls(cases, size);
  AddFastFalls(cases, size);
  AddFarOnes(cases, size);
  AddBursts(cases, size);
  return cases;
}

std::vector<std::pair<std::string, Collider>> EachKind(double top_m) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Vector3d::UnitY()));
  Collider map = FallingOnDistanceMap(4).parameters.colliders.front();
  map.pose.position_m.y() = top_m;
  return {
      {"sphere", SphereAt({0.5, top_m - 0.3, 0.5}, 0.3)},
      {"plane", PlaneThrough({0, top_m, 0}, Vector3d(0.1, 1, 0.05).normalized())},
      {"capsule", CapsuleBetween({0.2, top_m - 0.1, 0.4}, {0.8, top_m - 0.1, 0.6}, 0.1)},
      {"box", BoxAt({0.5, top_m - 0.2, 0.5}, {0.3, 0.2, 0.25}, turn)},
      {"map", map},
  };
}

std::vector<std::pair<std::string, Collider>> EveryKind(double top_m) {
  auto kinds = EachKind(top_m);
  kinds.emplace_back("cylinder",
                     CylinderBetween({0.2, top_m - 0.1, 0.4}, {0.7, top_m - 0.1, 0.6}, 0.1));
  return kinds;
}

Scene ReachSheet(const std::string& name, Preset preset, uint32_t columns, uint32_t rows,
                 std::vector<uint32_t> pins) {
  Scene scene = Grid(columns, rows, 1, 1, std::move(pins));
  scene.name = name;
  scene.parameters.settings = PresetSettings(preset);
  if (preset == Preset::kPaper) scene.parameters.settings.substeps = 2;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.restitution = 0.3;
  scene.parameters.thickness_m = 0.002;
  return scene;
}

Collider Wall(double x_m) {
  return PlaneThrough({x_m, 0, 0}, {-1, 0, 0});
}

}  // namespace drape::test
