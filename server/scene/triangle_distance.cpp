#include "server/scene/triangle_distance.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace drape {
namespace {

using Eigen::Vector3d;

// Nearest point of edge k; `along` is its parameter in [0, 1].
NearestOnTriangle NearestOnEdge(const TriangleGeometry& triangle, int k, const Vector3d& p) {
  const Vector3d& start = triangle.corners_m[k];
  const Vector3d edge = triangle.corners_m[(k + 1) % 3] - start;
  const double along = (p - start).dot(edge) / edge.squaredNorm();
  NearestOnTriangle nearest;
  if (along > 0 && along < 1) {
    nearest.point_m = start + along * edge;
    nearest.feature = TriangleFeature::kEdge;
    nearest.feature_index = static_cast<uint8_t>(k);
  } else {
    const int corner = along > 0 ? (k + 1) % 3 : k;
    nearest.point_m = triangle.corners_m[corner];
    nearest.feature = TriangleFeature::kCorner;
    nearest.feature_index = static_cast<uint8_t>(corner);
  }
  nearest.distance_sq = (p - nearest.point_m).squaredNorm();
  return nearest;
}

}  // namespace

TriangleGeometry MakeTriangleGeometry(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return {.corners_m = {a, b, c}, .normal = (b - a).cross(c - a).normalized()};
}

NearestOnTriangle NearestPoint(const TriangleGeometry& triangle, const Vector3d& p) {
  bool is_above_face = true;
  NearestOnTriangle nearest;
  nearest.distance_sq = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3d& start = triangle.corners_m[k];
    const Vector3d edge = triangle.corners_m[(k + 1) % 3] - start;
    if (edge.cross(triangle.normal).dot(p - start) <= 0) continue;
    is_above_face = false;
    // The nearest point is on an edge whose plane p is beyond.
    const NearestOnTriangle on_edge = NearestOnEdge(triangle, k, p);
    if (on_edge.distance_sq < nearest.distance_sq) nearest = on_edge;
  }
  if (!is_above_face) return nearest;
  const double height = triangle.normal.dot(p - triangle.corners_m[0]);
  return {.distance_sq = height * height,
          .point_m = p - height * triangle.normal,
          .feature = TriangleFeature::kFace,
          .feature_index = 0};
}

}  // namespace drape
