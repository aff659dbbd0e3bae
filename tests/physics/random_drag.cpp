#include "tests/physics/random_drag.h"

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "server/scene/surface_distance.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

class Numbers {
 public:
  explicit Numbers(uint32_t seed) : random_(seed) {}
  double In(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  uint32_t Below(uint32_t count) { return static_cast<uint32_t>(In(0, count)); }

 private:
  std::mt19937 random_;
};

// A table, a turned box, a cylinder or a thin capsule that the first row is beyond of. None so thin
// that it comes through the cloth while nothing moves (collider_contact.cpp).
Collider SharpCollider(uint32_t kind, const Vector3d& corner, double width, double edge,
                       Numbers& random) {
  const double beyond = random.In(0.06, 0.2), top = random.In(-0.05, -0.01);
  const Quaterniond turn(AngleAxisd(random.In(-0.4, 0.4), Vector3d::UnitY()));
  if (kind < 2) {
    const Vector3d half(random.In(0.3, 0.6), random.In(0.1, 0.3), random.In(0.2, 0.4));
    const Vector3d axis = Vector3d(random.In(-1, 1), 0, random.In(-1, 1)).normalized();
    const double tilt = kind == 1 ? random.In(-0.4, 0.4) : 0;
    const double lower = kind == 1 ? 0.08 : 0;
    return BoxAt(corner + Vector3d(width / 2, top - half.y() - lower, beyond + half.z()), half,
                 turn * Quaterniond(AngleAxisd(tilt, axis)));
  }
  const double radius = kind == 2 ? random.In(edge, 0.1) : edge * random.In(1, 1.45);
  const Vector3d along = turn * Vector3d(random.In(0.3, 0.6), random.In(-0.1, 0.1), 0);
  const double height = top - radius - std::abs(along.y());
  const Vector3d centre = corner + Vector3d(width / 2, height, beyond + random.In(0, 0.2));
  return kind == 2 ? CylinderBetween(centre - along, centre + along, radius)
                   : CapsuleBetween(centre - along, centre + along, radius);
}

// A ball or a thick capsule there, whose edges AUTO never touches.
Collider RoundCollider(bool is_ball, double width, Numbers& random) {
  const double radius = random.In(0.12, 0.3), top = random.In(-0.05, -0.01);
  const Vector3d centre(random.In(0.2, 0.8) * width, top - radius, radius + random.In(0.06, 0.2));
  if (is_ball) return SphereAt(centre, radius);
  const Vector3d along(random.In(0.2, 0.5), 0, random.In(-0.1, 0.1));
  return CapsuleBetween(centre - along, centre + along, radius);
}

// Whether what is held keeps clear of the collider all the way: else it would be drawn into it.
bool IsClear(const Drag& drag, const Collider& collider) {
  const double clearance = 0.02 + drag.scene.parameters.thickness_m;
  for (int k = 0; k <= 50; ++k) {
    for (const Grip& grip : drag.HeldAt(drag.drag_s * k / 50)) {
      if (SurfaceOf(collider, grip.target_m).distance_m <= clearance) return false;
    }
  }
  return true;
}

// Whether the line between the two that are held does: a row that is drawn around a corner is torn.
bool IsClearBetween(const Drag& drag, const Collider& collider) {
  for (int k = 0; k <= 50; ++k) {
    const std::vector<Grip> held = drag.HeldAt(drag.drag_s * k / 50);
    for (int part = 1; part < 50; ++part) {
      const Vector3d between =
          held[0].target_m + part / 50.0 * (held.back().target_m - held[0].target_m);
      if (SurfaceOf(collider, between).distance_m <= drag.scene.parameters.thickness_m)
        return false;
    }
  }
  return true;
}

// Of 12 to 24 particles a side, held by one or two of its first row.
struct Towel {
  uint32_t columns = 0, rows = 0;
  double width = 0, height = 0;  // [m]
  double edge_m() const { return std::max(width / (columns - 1), height / (rows - 1)); }
};

Towel MakeTowel(Drag& drag, const StructuralMaterial& material, Numbers& random) {
  Towel towel;
  towel.columns = 12 + random.Below(13);
  towel.rows = 12 + random.Below(13);
  towel.width = random.In(0.5, 0.8);
  towel.height = random.In(0.5, 0.8);
  drag.cell_m = towel.width / (towel.columns - 1);
  drag.held = {random.Below(4)};
  if (random.Below(3) > 0) drag.held.push_back(towel.columns - 1 - random.Below(4));
  const std::vector<uint32_t> pins = drag.is_gripped ? std::vector<uint32_t>{} : drag.held;
  StructuralMaterial woven = material;
  if (drag.is_mesh) woven.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  const auto make = drag.is_mesh ? MeshedGrid : Grid;
  drag.scene = make(towel.columns, towel.rows, towel.width, towel.height, pins, woven);
  drag.scene.parameters.settings = PresetSettings(Preset::kRealtime);
  drag.scene.parameters.max_grips = drag.is_gripped ? 2 : 0;
  return towel;
}

}  // namespace

Drag RandomDrag(uint32_t seed) {
  Numbers random(seed + 1000);
  Drag drag;
  drag.is_mesh = seed / 4 % 2 == 1;
  drag.is_gripped = seed / 8 % 2 == 1;
  const Towel towel = MakeTowel(drag, {}, random);
  ClothParameters& parameters = drag.scene.parameters;
  parameters.settings.time_step_s = seed % 3 == 0 ? 1.0 / 120 : 1.0 / 60;
  parameters.friction_static = random.In(0.3, 0.6);
  parameters.friction_dynamic = parameters.friction_static * random.In(0.7, 1);
  parameters.thickness_m = random.In(0, 0.004);
  parameters.damping_per_s = 1;
  const Vector3d corner = seed % 5 == 4 ? Vector3d(40, 5, -30) : Vector3d(0, 0, 0);
  for (Vector3d& p : drag.scene.state.positions_m) p += corner;
  for (const uint32_t i : drag.held) drag.starts.push_back(drag.scene.state.positions_m[i]);
  const double speed = std::pow(10, random.In(-1, 0));
  drag.drag_s = std::min(3.0, random.In(0.3, 0.6) / speed);
  do {
    parameters.colliders = {SharpCollider(seed % 4, corner, towel.width, towel.edge_m(), random)};
    const Vector3d along(random.In(-0.7, 0.7), random.In(-1, 0.7), random.In(-1, 0.2));
    drag.velocities.assign(drag.held.size(), speed * along.normalized());
  } while (!IsClear(drag, parameters.colliders[0]));
  return drag;
}

Drag RandomDragToRest(uint32_t seed) {
  Numbers random(seed + 5000);
  Drag drag;
  drag.is_mesh = seed % 2 == 1;
  drag.is_gripped = random.Below(2) == 1;
  StructuralMaterial fabric{.areal_density_kg_per_m2 = random.In(0.08, 0.4)};
  if (random.Below(2) == 1) {
    fabric.bending_rigidity_n_m = std::pow(10, random.In(-6, -4));
    fabric.shear_modulus_n_per_m = drag.is_mesh ? 0 : random.In(10, 100);
  }
  const Towel towel = MakeTowel(drag, fabric, random);
  ClothParameters& parameters = drag.scene.parameters;
  constexpr std::array<double, 4> kSteps_s{1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240};
  parameters.settings.time_step_s = kSteps_s[random.Below(4)];
  parameters.friction_static = random.In(0.1, 1);
  parameters.friction_dynamic = parameters.friction_static * random.In(0.3, 1);
  parameters.thickness_m = random.In(0, 0.004);
  parameters.damping_per_s = 2;
  for (const uint32_t i : drag.held) drag.starts.push_back(drag.scene.state.positions_m[i]);
  const double speed = std::pow(10, random.In(-1, 0.2));
  drag.drag_s = std::min(3.0, random.In(0.2, 0.6) / speed);
  const uint32_t kind = random.Below(6);
  do {
    parameters.colliders = {
        kind < 4 ? SharpCollider(kind, Vector3d::Zero(), towel.width, towel.edge_m(), random)
                 : RoundCollider(kind == 4, towel.width, random)};
    const Vector3d along(random.In(-0.7, 0.7), random.In(-1, 0.7), random.In(-1, 0.2));
    drag.velocities.assign(drag.held.size(), speed * along.normalized());
    if (drag.held.size() == 2) {
      const Vector3d closer = random.In(0, 0.1) / drag.drag_s * (drag.starts[1] - drag.starts[0]);
      drag.velocities[0] += closer;
      drag.velocities[1] -= closer;
    }
  } while (!IsClear(drag, parameters.colliders[0]) ||
           !IsClearBetween(drag, parameters.colliders[0]));
  return drag;
}

}  // namespace drape::test
