#include "server/scene/closed_mesh.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <tuple>

#include "server/core/violations.h"
#include "server/scene/description_checks.h"
#include "server/scene/mesh.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Share of the cubed longest side of the bounding box [-]: far above the rounding of the sum over
// the triangles, far below a sheet of a micrometre's thickness.
constexpr double kMinVolumeRatio = 1e-12;

// Smaller solids than this are lost in the rounding of single precision.
constexpr double kMinExtent_m = 1e-6;

struct HalfEdge {
  uint32_t low = 0;   // smaller vertex
  uint32_t high = 0;  // larger vertex
  uint32_t index = 0;
  bool is_ascending = false;  // runs from low to high

  bool IsSameEdge(const HalfEdge& other) const { return low == other.low && high == other.high; }
};

// Sorted, so that the half-edges of one edge are adjacent.
std::vector<HalfEdge> SortedHalfEdges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t from = triangle[k];
      const uint32_t to = triangle[(k + 1) % 3];
      half_edges.push_back({std::min(from, to), std::max(from, to),
                            static_cast<uint32_t>(half_edges.size()), from < to});
    }
  }
  std::sort(half_edges.begin(), half_edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.index) < std::tie(b.low, b.high, b.index);
  });
  return half_edges;
}

// Calls visit(span of the half-edges) once per edge.
template <class Visit>
void ForEachEdge(const std::vector<HalfEdge>& sorted, Visit visit) {
  for (size_t begin = 0; begin < sorted.size();) {
    size_t end = begin + 1;
    while (end < sorted.size() && sorted[end].IsSameEdge(sorted[begin])) ++end;
    visit(std::span(sorted).subspan(begin, end - begin));
    begin = end;
  }
}

FieldPath TriangleField(uint32_t triangle) {
  return FieldPath("mesh.triangles").At(triangle);
}

void CheckSizes(const TriangleMesh& mesh, const ClosedMeshLimits& limits, Violations& violations) {
  const size_t vertex_count = mesh.positions_m.size();
  if (vertex_count > limits.max_vertices) {
    violations.Add("mesh.positions_m",
                   fmt::format("{} vertices; at most {}", vertex_count, limits.max_vertices));
  }
  const size_t triangle_count = mesh.triangles.size();
  if (triangle_count < 4 || triangle_count > limits.max_triangles) {
    violations.Add("mesh.triangles", fmt::format("{} triangles; a closed mesh has 4 to {}",
                                                 triangle_count, limits.max_triangles));
  }
}

void CheckAreas(const TriangleMesh& mesh, Violations& violations) {
  for (uint32_t t = 0; t < mesh.triangles.size() && !violations.is_full(); ++t) {
    if (!IsDegenerate(mesh, mesh.triangles[t])) continue;
    violations.Add(TriangleField(t), "no area; collapse its shortest edge");
  }
}

void CheckEdges(const std::vector<HalfEdge>& sorted, Violations& violations) {
  ForEachEdge(sorted, [&](std::span<const HalfEdge> edge) {
    const auto [low, high] = std::pair(edge[0].low, edge[0].high);
    if (edge.size() != 2) {
      violations.Add(TriangleField(edge[0].index / 3),
                     fmt::format("edge {}-{} belongs to {} triangle{}; exactly 2 in a closed mesh",
                                 low, high, edge.size(), edge.size() == 1 ? "" : "s"));
    } else if (edge[0].is_ascending == edge[1].is_ascending) {
      violations.Add(TriangleField(edge[1].index / 3),
                     fmt::format("runs along edge {}-{} the same way as triangle {}; neighbours of "
                                 "one winding run opposite ways",
                                 low, high, edge[0].index / 3));
    }
  });
}

uint32_t NextInTriangle(uint32_t half_edge) {
  return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
}

std::vector<uint32_t> Twins(const std::vector<HalfEdge>& sorted) {
  std::vector<uint32_t> twins(sorted.size());
  for (size_t k = 0; k + 1 < sorted.size(); k += 2) {
    twins[sorted[k].index] = sorted[k + 1].index;
    twins[sorted[k + 1].index] = sorted[k].index;
  }
  return twins;
}

// Two solids that touch in one vertex have no normal there.
void CheckFans(const TriangleMesh& mesh, const std::vector<uint32_t>& twins,
               Violations& violations) {
  std::vector<uint32_t> corner_counts(mesh.positions_m.size(), 0);
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) ++corner_counts[vertex];
  }
  std::vector<bool> is_seen(mesh.positions_m.size(), false);
  for (uint32_t first = 0; first < twins.size() && !violations.is_full(); ++first) {
    const uint32_t vertex = mesh.triangles[first / 3][first % 3];
    if (is_seen[vertex]) continue;
    is_seen[vertex] = true;
    uint32_t fan_size = 0;
    uint32_t outgoing = first;
    do {
      ++fan_size;
      outgoing = NextInTriangle(twins[outgoing]);
    } while (outgoing != first);
    if (fan_size == corner_counts[vertex]) continue;
    violations.Add(FieldPath("mesh.positions_m").At(vertex),
                   "joins parts that share no edge there; give each part a vertex of its own");
  }
}

double LongestSide(const TriangleMesh& mesh) {
  Vector3d low = mesh.positions_m[mesh.triangles[0][0]];
  Vector3d high = low;
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) {
      low = low.cwiseMin(mesh.positions_m[vertex]);
      high = high.cwiseMax(mesh.positions_m[vertex]);
    }
  }
  return (high - low).maxCoeff();
}

void CheckVolume(const TriangleMesh& mesh, Violations& violations) {
  const double volume = EnclosedVolume(mesh);
  const double side = LongestSide(mesh);
  if (side < kMinExtent_m) {
    violations.Add("mesh.positions_m",
                   fmt::format("a mesh {} m long; at least {} m", side, kMinExtent_m));
    return;
  }
  const double smallest = kMinVolumeRatio * side * side * side;
  if (volume >= smallest) return;
  violations.Add(
      "mesh.triangles",
      volume <= -smallest
          ? fmt::format("inside out: it encloses {} m^3; triangles are counter-clockwise "
                        "seen from outside, reverse them",
                        volume)
          : fmt::format("encloses {} m^3, which is no volume; at least {} m^3", volume, smallest));
}

}  // namespace

double EnclosedVolume(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  const Vector3d origin = mesh.positions_m[mesh.triangles[0][0]];  // keeps the terms small
  double six_volumes = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3d a = mesh.positions_m[i] - origin;
    const Vector3d b = mesh.positions_m[j] - origin;
    const Vector3d c = mesh.positions_m[k] - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

SolidMoments MomentsOf(const TriangleMesh& mesh) {
  SolidMoments moments;
  if (mesh.triangles.empty()) return moments;
  const Vector3d origin = mesh.positions_m[mesh.triangles[0][0]];  // keeps the terms small
  Vector3d first = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3d a = mesh.positions_m[i] - origin;
    const Vector3d b = mesh.positions_m[j] - origin;
    const Vector3d c = mesh.positions_m[k] - origin;
    const Vector3d sum = a + b + c;
    const double volume = a.dot(b.cross(c)) / 6;
    moments.volume_m3 += volume;
    first += volume / 4 * sum;
    second += volume / 20 *
              (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  const Vector3d centroid = first / moments.volume_m3;
  moments.centroid_m = origin + centroid;
  moments.second_m5 = second - moments.volume_m3 * centroid * centroid.transpose();
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) {
      const double distance = (mesh.positions_m[vertex] - moments.centroid_m).norm();
      moments.radius_m = std::max(moments.radius_m, distance);
    }
  }
  return moments;
}

std::vector<Vector3d> OutermostVertices(const TriangleMesh& mesh, int directions) {
  std::vector<uint32_t> outermost;
  for (int k = 0; k < directions; ++k) {
    const double y = 1 - (2 * k + 1.0) / directions;
    const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - y * y);
    const Vector3d direction(across * std::cos(angle), y, across * std::sin(angle));
    uint32_t best = mesh.triangles[0][0];
    for (const auto& triangle : mesh.triangles) {
      for (const uint32_t vertex : triangle) {
        const double along = direction.dot(mesh.positions_m[vertex] - mesh.positions_m[best]);
        if (along > 0) best = vertex;
      }
    }
    outermost.push_back(best);
  }
  std::ranges::sort(outermost);
  outermost.erase(std::unique(outermost.begin(), outermost.end()), outermost.end());
  std::vector<Vector3d> places;
  for (const uint32_t vertex : outermost) places.push_back(mesh.positions_m[vertex]);
  return places;
}

std::vector<uint32_t> TwinHalfEdges(const TriangleMesh& mesh) {
  return Twins(SortedHalfEdges(mesh));
}

std::vector<FieldViolation> CheckClosedMesh(const TriangleMesh& mesh,
                                            const ClosedMeshLimits& limits) {
  // Each check relies on the ones before it.
  Violations violations;
  CheckSizes(mesh, limits, violations);
  if (violations.is_empty()) CheckMeshValues(mesh, violations);
  if (violations.is_empty()) CheckAreas(mesh, violations);
  if (!violations.is_empty()) return violations.Take();
  const std::vector<HalfEdge> half_edges = SortedHalfEdges(mesh);
  CheckEdges(half_edges, violations);
  if (violations.is_empty()) CheckFans(mesh, Twins(half_edges), violations);
  if (violations.is_empty()) CheckVolume(mesh, violations);
  return violations.Take();
}

}  // namespace drape
