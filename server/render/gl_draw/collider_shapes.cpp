#include "server/render/gl_draw/collider_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace drape::render {

namespace {

using Eigen::Vector3d;

// Places that differ by less are the same: what is left of shifts by environment origins.
constexpr double kSamePlace_m = 1e-6;

double Rounded(double value) {
  return std::round(value / kSamePlace_m);
}

double DrawnRadius(double radius_m, double length_scale_m) {
  constexpr double kLargestStretch_sq = 1.2 * 1.2;
  const double sag = 2 * kLargestStretch_sq * length_scale_m * length_scale_m / (8 * radius_m);
  return radius_m - std::min(sag + 0.004 * radius_m, 0.25 * radius_m);
}

}  // namespace

ColliderShapes CollectColliders(std::span<const DrawnCloth> cloths) {
  std::map<std::array<double, 4>, DrawnSphere> spheres;
  std::map<std::array<double, 4>, DrawnPlane> planes;
  for (const DrawnCloth& cloth : cloths) {
    const Vector3d& origin = cloth.placement.environment_origin_m;
    for (const Collider& collider : cloth.colliders) {
      if (const auto* sphere = std::get_if<SphereCollider>(&collider)) {
        const Vector3d center = sphere->center_m + origin;
        const double drawn = DrawnRadius(sphere->radius_m, cloth.model->length_scale_m());
        const auto [place, is_new] =
            spheres.try_emplace({Rounded(center.x()), Rounded(center.y()), Rounded(center.z()),
                                 Rounded(sphere->radius_m)},
                                DrawnSphere{center, sphere->radius_m, drawn});
        place->second.drawn_radius_m = std::min(place->second.drawn_radius_m, drawn);
      } else if (const auto* plane = std::get_if<PlaneCollider>(&collider)) {
        const Vector3d point = plane->point_m + origin;
        const Vector3d& normal = plane->normal;
        planes.try_emplace({Rounded(normal.x()), Rounded(normal.y()), Rounded(normal.z()),
                            Rounded(normal.dot(point))},
                           DrawnPlane{point, normal});
      }
    }
  }
  ColliderShapes shapes;
  for (const auto& [key, sphere] : spheres) shapes.spheres.push_back(sphere);
  for (const auto& [key, plane] : planes) shapes.planes.push_back(plane);
  return shapes;
}

bool IsNear(const DrawnSphere& sphere, const Eigen::AlignedBox3d& bounds_m) {
  const double diagonal = bounds_m.diagonal().norm();
  return sphere.radius_m <= 1.5 * diagonal &&
         bounds_m.exteriorDistance(sphere.center_m) - sphere.radius_m <= 0.5 * diagonal;
}

}  // namespace drape::render
