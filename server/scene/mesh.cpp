#include "server/scene/mesh.h"

#include <algorithm>
#include <unordered_map>

#include "server/core/keyed_hash.h"

namespace drape {

namespace {

// Share of the squared longest edge [-], see IsDegenerate.
constexpr double kMinAreaRatio = 1e-12;

}  // namespace

std::vector<MeshEdge> UniqueEdges(const std::vector<std::array<uint32_t, 3>>& triangles) {
  std::vector<MeshEdge> edges;
  std::unordered_map<uint64_t, uint32_t, KeyedHash> edge_of_vertices;
  edges.reserve(triangles.size() * 3 / 2);
  edge_of_vertices.reserve(triangles.size() * 3 / 2);
  for (const auto& triangle : triangles) {
    for (int corner = 0; corner < 3; ++corner) {
      const auto [i, j] = std::minmax(triangle[corner], triangle[(corner + 1) % 3]);
      const uint64_t key = (uint64_t{i} << 32) | j;
      const auto [entry, is_new] = edge_of_vertices.emplace(key, edges.size());
      if (is_new) edges.push_back({.i = i, .j = j, .opposite_vertices = {}});
      edges[entry->second].opposite_vertices.push_back(triangle[(corner + 2) % 3]);
    }
  }
  return edges;
}

std::vector<std::array<uint32_t, 2>> SheetsAcross(const MeshEdge& edge,
                                                  const std::vector<Eigen::Vector3d>& positions_m) {
  const std::vector<uint32_t>& apexes = edge.opposite_vertices;
  if (apexes.size() == 2) {
    if (apexes[0] == apexes[1]) return {};
    return {{apexes[0], apexes[1]}};
  }
  const Eigen::Vector3d& origin = positions_m[edge.i];
  const Eigen::Vector3d along = (positions_m[edge.j] - origin).stableNormalized();
  std::vector<Eigen::Vector3d> away;  // across the edge, within the triangle
  for (const uint32_t apex : apexes) {
    const Eigen::Vector3d side = positions_m[apex] - origin;
    away.push_back((side - side.dot(along) * along).stableNormalized());
  }
  struct Pair {
    double cosine;
    size_t a, b;
  };
  std::vector<Pair> pairs;
  for (size_t a = 0; a < apexes.size(); ++a) {
    for (size_t b = a + 1; b < apexes.size(); ++b) {
      if (apexes[a] != apexes[b]) pairs.push_back({away[a].dot(away[b]), a, b});
    }
  }
  std::ranges::stable_sort(pairs, {}, &Pair::cosine);
  std::vector<std::array<uint32_t, 2>> sheets;
  std::vector<bool> is_taken(apexes.size());
  for (const auto& [cosine, a, b] : pairs) {
    if (is_taken[a] || is_taken[b]) continue;
    is_taken[a] = is_taken[b] = true;
    sheets.push_back({apexes[a], apexes[b]});
  }
  return sheets;
}

double TriangleArea(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

bool IsDegenerate(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle) {
  const auto [i, j, k] = triangle;
  if (i == j || j == k || k == i) return true;
  const Eigen::Vector3d& a = mesh.positions_m[i];
  const Eigen::Vector3d& b = mesh.positions_m[j];
  const Eigen::Vector3d& c = mesh.positions_m[k];
  const double longest_sq =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  // Also true for three coincident vertices, where both sides are 0.
  return TriangleArea(a, b, c) <= kMinAreaRatio * longest_sq;
}

}  // namespace drape
