#include "server/scene/woven_edges.h"

#include <Eigen/Geometry>
#include <cmath>

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

Vector3d Across(const Vector3d& direction) {
  const Vector3d across = direction.cross(Vector3d::UnitZ());
  return across.norm() > 0.5 ? across.normalized()
                             : direction.cross(Vector3d::UnitX()).normalized();
}

// In the plane with this unit normal.
Vector3d WarpIn(const Vector3d& normal, const Vector3d& direction) {
  const auto projected = [&](const Vector3d& d) { return Vector3d(d - d.dot(normal) * normal); };
  const Vector3d warp = projected(direction);
  return warp.squaredNorm() >= 0.5 ? warp.normalized() : projected(Across(direction)).normalized();
}

}  // namespace

double BiasOf(const MeshEdge& edge, const std::vector<Vector3d>& positions_m,
              const Vector3d& warp_direction) {
  const Vector3d direction = warp_direction.normalized();
  const Vector3d along = (positions_m[edge.j] - positions_m[edge.i]).normalized();
  double sum = 0;
  for (const uint32_t k : edge.opposite_vertices) {
    const Vector3d normal = along.cross(positions_m[k] - positions_m[edge.i]).normalized();
    const double cosine = along.dot(WarpIn(normal, direction));
    const double sine_sq = 1 - cosine * cosine;
    sum += cosine * cosine * sine_sq;
  }
  const double bias = sum / static_cast<double>(edge.opposite_vertices.size());
  return bias > kRounding ? bias : 0;  // an edge along an inextensible thread has no compliance
}

}  // namespace drape
