#include "server/render/gl_draw/collider_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "server/scene/distance_map.h"

namespace drape::render {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Positions that differ by less are equal: the round-off of shifts by environment origins.
constexpr double kSamePlace_m = 1e-6;
constexpr double kShare = 0.004;

double Rounded(double value) {
  return std::round(value / kSamePlace_m);
}

double DrawnRadius(double radius_m, double length_scale_m) {
  constexpr double kLargestStretch_sq = 1.2 * 1.2;
  const double sag = 2 * kLargestStretch_sq * length_scale_m * length_scale_m / (8 * radius_m);
  return radius_m - std::min(sag + kShare * radius_m, 0.25 * radius_m);
}

double DrawnHalfExtent(double half_m, double length_scale_m) {
  return half_m - std::min(0.2 * length_scale_m + kShare * half_m, 0.25 * half_m);
}

// A cylinder of radius 1 around the second axis, from -1 to 1.
const std::shared_ptr<const TriangleMesh>& UnitCylinder() {
  static const auto& cylinder = *new std::shared_ptr<const TriangleMesh>([] {
    constexpr uint32_t kSegments = 96, kLowMiddle = 0, kHighMiddle = 1;
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->positions_m = {Vector3d(0, -1, 0), Vector3d(0, 1, 0)};
    for (uint32_t k = 0; k < kSegments; ++k) {
      const double angle = 2 * std::numbers::pi * k / kSegments;
      mesh->positions_m.emplace_back(std::sin(angle), -1, std::cos(angle));
      mesh->positions_m.emplace_back(std::sin(angle), 1, std::cos(angle));
      const uint32_t low = 2 + 2 * k, next_low = 2 + 2 * ((k + 1) % kSegments);
      const uint32_t high = low + 1, next_high = next_low + 1;
      mesh->triangles.push_back({kLowMiddle, next_low, low});
      mesh->triangles.push_back({kHighMiddle, high, next_high});
      mesh->triangles.push_back({low, next_low, next_high});
      mesh->triangles.push_back({low, next_high, high});
    }
    return mesh;
  }());
  return cylinder;
}

// One shape in the environment of a cloth as a solid in that environment.
struct ToSolid {
  const RigidTransform& pose;
  double length_scale_m;

  DrawnSolid operator()(const SphereShape& sphere) const {
    DrawnSolid solid;
    solid.center_m = pose.position_m;
    solid.radius_m = sphere.radius_m;
    solid.drawn_radius_m = DrawnRadius(sphere.radius_m, length_scale_m);
    return solid;
  }
  DrawnSolid operator()(const CapsuleShape& capsule) const {
    DrawnSolid solid;
    const Vector3d a = pose * capsule.a_m;
    const Vector3d segment = pose * capsule.b_m - a;
    solid.center_m = a + segment / 2;
    solid.axes = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitY(), segment).toRotationMatrix();
    solid.half_extents_m = Vector3d(0, segment.norm() / 2, 0);
    solid.drawn_half_extents_m = solid.half_extents_m;
    if (segment.isZero()) solid.axes.setIdentity();
    solid.radius_m = capsule.radius_m;
    solid.drawn_radius_m = DrawnRadius(capsule.radius_m, length_scale_m);
    return solid;
  }
  DrawnSolid operator()(const BoxShape& box) const {
    DrawnSolid solid;
    solid.center_m = pose.position_m;
    solid.axes = pose.rotation.toRotationMatrix();
    solid.half_extents_m = box.half_extents_m;
    for (int k = 0; k < 3; ++k) {
      solid.drawn_half_extents_m[k] = DrawnHalfExtent(box.half_extents_m[k], length_scale_m);
    }
    return solid;
  }
  // Drawn as UnitCylinder, scaled by its drawn half extents.
  DrawnSolid operator()(const CylinderShape& cylinder) const {
    const Vector3d segment = pose * cylinder.b_m - pose * cylinder.a_m;
    const double radius_m = cylinder.radius_m, half_length_m = segment.norm() / 2;
    const double drawn_radius_m = DrawnRadius(radius_m, length_scale_m);
    DrawnSolid solid;
    solid.center_m = (pose * cylinder.a_m + pose * cylinder.b_m) / 2;
    solid.axes = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitY(), segment).toRotationMatrix();
    solid.half_extents_m = {radius_m, half_length_m, radius_m};
    solid.drawn_half_extents_m = {drawn_radius_m, DrawnHalfExtent(half_length_m, length_scale_m),
                                  drawn_radius_m};
    solid.mesh = UnitCylinder();
    return solid;
  }
  DrawnSolid operator()(const DistanceMapShape& shape) const {
    const DistanceMap& map = *shape.map;
    const double margin_m = DistanceMap::kMarginCells * map.cell_m();
    DrawnSolid solid;
    solid.mesh = {shape.map, &map.mesh()};
    solid.mesh_center_m = (map.low_m() + map.high_m()) / 2;
    solid.center_m = pose * solid.mesh_center_m;
    solid.axes = pose.rotation.toRotationMatrix();
    solid.half_extents_m = (map.high_m() - map.low_m()) / 2 - Vector3d::Constant(margin_m);
    solid.inset_m = std::min(0.3 * length_scale_m, map.cell_m());
    return solid;
  }
  DrawnSolid operator()(const PlaneShape&) const { return {}; }  // not a solid
};

// Equal solids at the same position are drawn once.
using SolidKey = std::pair<const TriangleMesh*, std::vector<double>>;

std::vector<double> PlaceOf(const DrawnSolid& solid) {
  std::vector<double> place = {Rounded(solid.radius_m)};
  for (int k = 0; k < 3; ++k) {
    place.push_back(Rounded(solid.center_m[k]));
    place.push_back(Rounded(solid.half_extents_m[k]));
  }
  for (const double element : solid.axes.reshaped()) place.push_back(Rounded(element));
  return place;
}

}  // namespace

ColliderShapes CollectColliders(std::span<const DrawnCloth> cloths) {
  std::map<SolidKey, DrawnSolid> solids;
  std::map<std::vector<double>, DrawnPlane> planes;
  for (const DrawnCloth& cloth : cloths) {
    const Vector3d& origin = cloth.placement.environment_origin_m;
    for (const Collider& collider : cloth.colliders) {
      if (const auto* plane = std::get_if<PlaneShape>(&collider.shape)) {
        const Vector3d point = collider.pose.position_m + origin;
        const Vector3d normal = collider.pose.rotation * plane->normal;
        planes.try_emplace({Rounded(normal.x()), Rounded(normal.y()), Rounded(normal.z()),
                            Rounded(normal.dot(point))},
                           DrawnPlane{point, normal});
        continue;
      }
      DrawnSolid solid =
          std::visit(ToSolid{collider.pose, cloth.model->length_scale_m()}, collider.shape);
      solid.center_m += origin;
      DrawnSolid& drawn =
          solids.try_emplace({solid.mesh.get(), PlaceOf(solid)}, solid).first->second;
      drawn.drawn_radius_m = std::min(drawn.drawn_radius_m, solid.drawn_radius_m);
      drawn.inset_m = std::max(drawn.inset_m, solid.inset_m);
      drawn.drawn_half_extents_m = drawn.drawn_half_extents_m.cwiseMin(solid.drawn_half_extents_m);
    }
  }
  ColliderShapes shapes;
  for (auto& [key, solid] : solids) {
    if (solid.mesh == UnitCylinder()) solid.mesh_scale = solid.drawn_half_extents_m;
    shapes.solids.push_back(solid);
  }
  for (const auto& [key, plane] : planes) shapes.planes.push_back(plane);
  return shapes;
}

std::array<Vector3d, 8> CornersOf(const DrawnSolid& solid) {
  std::array<Vector3d, 8> corners;
  for (size_t k = 0; k < corners.size(); ++k) {
    const Vector3d side((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
    corners[k] = solid.center_m + solid.axes * side.cwiseProduct(solid.half_extents_m);
  }
  return corners;
}

bool IsNear(const DrawnSolid& solid, const Eigen::AlignedBox3d& bounds_m) {
  const double diagonal = bounds_m.diagonal().norm();
  const double reach = solid.half_extents_m.norm() + solid.radius_m;
  return reach <= 1.5 * diagonal &&
         bounds_m.exteriorDistance(solid.center_m) - reach <= 0.5 * diagonal;
}

}  // namespace drape::render
