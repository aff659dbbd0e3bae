#include "server/render/gl_draw/mesh_corners.h"

#include <cmath>
#include <cstdint>

namespace drape::render {

namespace {

using Eigen::Vector3d;

constexpr double kCreaseCosine = 0.766;  // cosine of 40 degrees
// At vertices with more faces than this (the tip of a cone) face normals are used, because the mean
// takes time proportional to the square of their number.
constexpr size_t kMaxFaces = 64;

// The faces around each vertex.
std::vector<std::vector<uint32_t>> FacesOfVertices(const TriangleMesh& mesh) {
  std::vector<std::vector<uint32_t>> faces(mesh.positions_m.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t vertex : mesh.triangles[t]) faces[vertex].push_back(t);
  }
  return faces;
}

// Its length is twice the area.
std::vector<Vector3d> FaceNormals(const TriangleMesh& mesh) {
  std::vector<Vector3d> normals;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d& origin = mesh.positions_m[a];
    normals.push_back((mesh.positions_m[b] - origin).cross(mesh.positions_m[c] - origin));
  }
  return normals;
}

Vector3d CornerNormal(const Vector3d& own, const std::vector<uint32_t>& faces,
                      const std::vector<Vector3d>& normals) {
  if (faces.size() > kMaxFaces) return own.stableNormalized();
  Vector3d sum = Vector3d::Zero();
  for (const uint32_t face : faces) {
    const Vector3d& normal = normals[face];
    if (normal.dot(own) >= kCreaseCosine * normal.norm() * own.norm()) sum += normal;
  }
  return sum.stableNormalized();
}

}  // namespace

std::vector<float> MeshCorners(const TriangleMesh& mesh, const Vector3d& center_m, double inset_m) {
  const std::vector<std::vector<uint32_t>> faces = FacesOfVertices(mesh);
  const std::vector<Vector3d> normals = FaceNormals(mesh);
  std::vector<Vector3d> drawn = mesh.positions_m;
  for (size_t vertex = 0; vertex < drawn.size(); ++vertex) {
    Vector3d mean = Vector3d::Zero();
    for (const uint32_t face : faces[vertex]) mean += normals[face];
    drawn[vertex] -= center_m + inset_m * mean.stableNormalized();
  }
  std::vector<float> corners;
  corners.reserve(18 * mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t vertex : mesh.triangles[t]) {
      const Vector3d normal = CornerNormal(normals[t], faces[vertex], normals);
      for (const Vector3d& v : {drawn[vertex], normal}) {
        for (const double component : v) corners.push_back(static_cast<float>(component));
      }
    }
  }
  return corners;
}

}  // namespace drape::render
