#include "server/scene/triangle_shares.h"

#include <algorithm>
#include <cstddef>
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

// Of all triangles for each particle that has any.
double MeanArea(std::span<const double> areas_m2, std::span<const double> areas_around_m2) {
  const auto has_area = [](double area_m2) { return area_m2 > 0; };
  const auto count = std::count_if(areas_around_m2.begin(), areas_around_m2.end(), has_area);
  const double total_m2 = std::accumulate(areas_m2.begin(), areas_m2.end(), 0.0);
  return total_m2 / static_cast<double>(std::max<ptrdiff_t>(count, 1));
}

}  // namespace

TriangleShares ShareTriangles(std::span<const Eigen::Vector3d> rest_positions_m,
                              std::span<const double> masses_kg,
                              std::span<const std::array<uint32_t, 3>> triangles,
                              ParticleAreas areas) {
  TriangleShares shares;
  GatherTriangles(triangles, masses_kg.size(), shares);
  std::vector<double> areas_m2;
  std::vector<double> areas_around_m2(masses_kg.size(), 0.0);
  for (const auto& [i, j, k] : triangles) {
    areas_m2.push_back(TriangleArea(rest_positions_m[i], rest_positions_m[j], rest_positions_m[k]));
    for (const uint32_t corner : {i, j, k}) areas_around_m2[corner] += areas_m2.back();
  }
  const double equal_area_m2 = MeanArea(areas_m2, areas_around_m2);
  for (const double around_m2 : areas_around_m2) {
    const bool is_equal = areas == ParticleAreas::kEqual && around_m2 > 0;
    shares.corner_shares.push_back(is_equal ? equal_area_m2 / around_m2 : 1.0 / 3);
  }
  for (size_t t = 0; t < triangles.size(); ++t) {
    double smallest_kg = std::numeric_limits<double>::infinity();
    for (const uint32_t corner : triangles[t]) {
      const double area_m2 = shares.corner_shares[corner] * areas_around_m2[corner];
      smallest_kg = std::min(smallest_kg, masses_kg[corner] * areas_m2[t] / area_m2);
    }
    shares.masses_kg.push_back(std::max(smallest_kg, kMinTriangleMass_kg));
  }
  return shares;
}

}  // namespace drape
