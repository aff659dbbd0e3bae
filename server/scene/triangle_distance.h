// The point of a triangle nearest to another point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace drape {

// Corners and unit normal ((b - a) x (c - a) normalised) of a triangle with area.
struct TriangleGeometry {
  std::array<Eigen::Vector3d, 3> corners_m;
  Eigen::Vector3d normal;
};

// Not degenerate in the sense of mesh.h.
TriangleGeometry MakeTriangleGeometry(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      const Eigen::Vector3d& c);

// The part of a triangle that contains a point. Edge k runs from corner k to corner k + 1 (mod 3).
enum class TriangleFeature : uint8_t { kFace, kEdge, kCorner };

struct NearestOnTriangle {
  double distance_sq = 0;  // [m^2]
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  TriangleFeature feature = TriangleFeature::kFace;
  uint8_t feature_index = 0;  // of the edge or corner; 0 for the face
};

// By the signs of p against the three planes through an edge along the normal, then the nearest of
// the edges; unlike barycentric coordinates this does not divide by the squared area, so slivers
// lose no digits.
NearestOnTriangle NearestPoint(const TriangleGeometry& triangle, const Eigen::Vector3d& p);

}  // namespace drape
