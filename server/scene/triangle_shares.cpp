#include "server/scene/triangle_shares.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "server/scene/mesh.h"

namespace drape {

namespace {

void GatherTriangles(std::span<const std::array<uint32_t, 3>> triangles, size_t particle_count,
                     TriangleShares& shares) {
  shares.offsets.assign(particle_count + 1, 0);
  for (const auto& corners : triangles) {
    for (const uint32_t corner : corners) ++shares.offsets[corner + 1];
  }
  std::partial_sum(shares.offsets.begin(), shares.offsets.end(), shares.offsets.begin());
  shares.triangles.resize(3 * triangles.size());
  std::vector<uint32_t> next(shares.offsets.begin(), shares.offsets.end() - 1);
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    for (const uint32_t corner : triangles[t]) shares.triangles[next[corner]++] = t;
  }
}

}  // namespace

TriangleShares ShareTriangles(std::span<const Eigen::Vector3d> rest_positions_m,
                              std::span<const double> masses_kg,
                              std::span<const std::array<uint32_t, 3>> triangles) {
  TriangleShares shares;
  GatherTriangles(triangles, masses_kg.size(), shares);
  std::vector<double> areas_m2;
  std::vector<double> areas_around_m2(masses_kg.size(), 0.0);
  for (const auto& [i, j, k] : triangles) {
    areas_m2.push_back(
        TriangleArea(rest_positions_m[i], rest_positions_m[j], rest_positions_m[k]));
    for (const uint32_t corner : {i, j, k}) areas_around_m2[corner] += areas_m2.back();
  }
  for (size_t t = 0; t < triangles.size(); ++t) {
    double smallest_kg = std::numeric_limits<double>::infinity();
    for (const uint32_t corner : triangles[t]) {
      smallest_kg = std::min(smallest_kg, masses_kg[corner] * areas_m2[t] / areas_around_m2[corner]);
    }
    shares.masses_kg.push_back(std::max(3 * smallest_kg, kMinTriangleMass_kg));
  }
  return shares;
}

}  // namespace drape
