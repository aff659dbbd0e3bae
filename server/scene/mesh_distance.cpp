#include "server/scene/mesh_distance.h"

#include <Eigen/Geometry>

#include <cmath>

#include "server/scene/closed_mesh.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Angle between two edges of a triangle; in [0, pi] also where rounding leaves a cosine above 1.
double AngleBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

MeshDistance::MeshDistance(const TriangleMesh& mesh) : tree_(mesh) {
  std::vector<Vector3d> vertex_normals(mesh.positions_m.size(), Vector3d::Zero());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const TriangleGeometry& triangle = tree_.triangle(t);
    for (int k = 0; k < 3; ++k) {
      const Vector3d& corner = triangle.corners_m[k];
      const double angle = AngleBetween(triangle.corners_m[(k + 1) % 3] - corner,
                                        triangle.corners_m[(k + 2) % 3] - corner);
      vertex_normals[mesh.triangles[t][k]] += angle * triangle.normal;
    }
  }
  const std::vector<uint32_t> twins = TwinHalfEdges(mesh);
  pseudonormals_.resize(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t neighbour = twins[3 * t + k] / 3;
      pseudonormals_[t].edges[k] = tree_.triangle(t).normal + tree_.triangle(neighbour).normal;
      pseudonormals_[t].corners[k] = vertex_normals[mesh.triangles[t][k]];
    }
  }
}

const Vector3d& MeshDistance::NormalAt(const NearestTriangle& found) const {
  const Pseudonormals& normals = pseudonormals_[found.triangle];
  switch (found.nearest.feature) {
    case TriangleFeature::kEdge:
      return normals.edges[found.nearest.feature_index];
    case TriangleFeature::kCorner:
      return normals.corners[found.nearest.feature_index];
    case TriangleFeature::kFace:
      break;
  }
  return tree_.triangle(found.triangle).normal;
}

SignedDistance MeshDistance::At(const Vector3d& p, std::optional<uint32_t> guess) const {
  const NearestTriangle found = tree_.Nearest(p, guess);
  const double distance = std::sqrt(found.nearest.distance_sq);
  const bool is_inside = (p - found.nearest.point_m).dot(NormalAt(found)) < 0;
  return {.distance_m = is_inside ? -distance : distance, .triangle = found.triangle};
}

}  // namespace drape
