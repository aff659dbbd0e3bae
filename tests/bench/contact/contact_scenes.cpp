#include "tests/bench/contact/contact_scenes.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace drape::bench {
namespace {

using Eigen::Vector3d;

constexpr double kFriction = 0.3;

// Shaken by a tenth of a millimetre, so that nothing is symmetric.
void Place(test::Scene& scene, const Eigen::Matrix3d& rotation, const Vector3d& shift_m) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-1e-4, 1e-4);
  for (Vector3d& p : scene.state.positions_m) {
    p = rotation * p + shift_m + Vector3d(noise(random), noise(random), noise(random));
  }
}

Eigen::Matrix3d Turned(double angle_rad, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

test::Scene Touching(test::Scene scene, const ContactPlayOptions& options) {
  ClothParameters& parameters = scene.parameters;
  parameters.settings = PresetSettings(Preset::kRealtime);
  parameters.settings.substeps = options.substeps;
  parameters.settings.sleep_motion_m = 0;
  parameters.friction_static = parameters.friction_dynamic = kFriction;
  parameters.self_collision = SelfCollision{.thickness_m = options.thickness_m,
                                            .friction_static = kFriction,
                                            .friction_dynamic = kFriction};
  return scene;
}

bool ChangesNothing(uint32_t, test::Scene&) {
  return false;
}

ContactPlay Fold(const ContactPlayOptions& options) {
  test::Scene scene = Touching(test::Grid(options.side, options.side, 1, 1), options);
  scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d::UnitY())};
  Place(scene, Turned(1.52, Vector3d::UnitX()), Vector3d(0, 1.05, 0));
  return {"fold", scene, 120, ChangesNothing};
}

ContactPlay OverASphere(const ContactPlayOptions& options, bool vanishes) {
  constexpr uint32_t kVanishes = 45;
  test::Scene scene = Touching(test::Grid(options.side, options.side, 1, 1), options);
  scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()),
                                SphereAt(Vector3d(0.52, 0.5, 0.49), 0.15)};
  Place(scene, Eigen::Matrix3d::Identity(), Vector3d(0, 0.68, 0));
  if (!vanishes) return {"drape", scene, 120, ChangesNothing};
  return {"pile", scene, 150, [](uint32_t frame, test::Scene& changed) {
            if (frame != kVanishes) return false;
            changed.parameters.colliders.pop_back();
            return true;
          }};
}

// Around the y axis; the first and the last ring are pins.
test::Scene Tube(uint32_t columns, uint32_t rows, double radius_m, double length_m) {
  TriangleMesh mesh;
  ModelDescription description;
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      const double angle_rad = 2 * std::numbers::pi * column / columns;
      mesh.positions_m.emplace_back(radius_m * std::cos(angle_rad), length_m * row / (rows - 1),
                                    radius_m * std::sin(angle_rad));
      if (row == 0 || row + 1 == rows) {
        description.pinned_particles.push_back(row * columns + column);
      }
      if (row + 1 == rows) continue;
      const uint32_t a = row * columns + column, b = row * columns + (column + 1) % columns;
      mesh.triangles.push_back({a, a + columns, b});
      mesh.triangles.push_back({b, a + columns, b + columns});
    }
  }
  description.topology = mesh;
  // As the service describes a mesh that says nothing of its stretch.
  description.material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  test::Scene scene;
  scene.model = test::BuildModel(description);
  scene.state = test::RestState(*scene.model);
  return scene;
}

ContactPlay Twist(const ContactPlayOptions& options) {
  constexpr uint32_t kFrames = 90;
  constexpr double kLength_m = 0.6;
  const uint32_t columns = options.side;
  test::Scene scene = Touching(Tube(columns, options.side, 0.1, kLength_m), options);
  const auto start = scene.state.positions_m;
  return {"twist", scene, kFrames, [=](uint32_t frame, test::Scene& changed) {
            const double share = double(frame + 1) / kFrames;
            changed.pin_targets_m.clear();
            for (const uint32_t pin : changed.model->pins()) {
              Vector3d target = start[pin];
              if (pin >= columns) {
                target = Turned(2 * std::numbers::pi * share, Vector3d::UnitY()) * target;
                target.y() -= 0.25 * kLength_m * share;
              }
              changed.pin_targets_m.push_back(target);
            }
            return false;
          }};
}

// By the whole first row it swings flat, from 0.3 rad off the vertical; by two corners, let go
// level, it may touch itself.
ContactPlay Swing(const ContactPlayOptions& options, bool by_corners) {
  std::vector<uint32_t> pins = {0, options.side - 1};
  if (!by_corners) {
    pins.resize(options.side);
    std::iota(pins.begin(), pins.end(), 0u);
  }
  test::Scene scene = Touching(test::Grid(options.side, options.side, 1, 1, pins), options);
  if (!by_corners) {
    Place(scene, Turned(std::numbers::pi / 2 - 0.3, Vector3d::UnitX()), Vector3d::Zero());
  }
  return {by_corners ? "swing" : "nothing", scene, 120, ChangesNothing};
}

}  // namespace

std::vector<ContactPlay> ContactPlays(const ContactPlayOptions& options) {
  return {Fold(options),        OverASphere(options, true),
          Twist(options),       OverASphere(options, false),
          Swing(options, true), Swing(options, false)};
}

}  // namespace drape::bench
