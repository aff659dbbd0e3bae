#include "tests/support/solids/solids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

namespace drape::test {

using Eigen::Vector3d;

TriangleMesh BoxMesh(const Vector3d& low, const Vector3d& high) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.positions_m.emplace_back((corner & 1) != 0 ? high.x() : low.x(),
                                  (corner & 2) != 0 ? high.y() : low.y(),
                                  (corner & 4) != 0 ? high.z() : low.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TriangleMesh SphereMesh(double radius, int subdivisions) {
  const double t = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.positions_m = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                      {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t i, uint32_t j) {
      const auto [entry, is_new] =
          middles.emplace(std::minmax(i, j), static_cast<uint32_t>(mesh.positions_m.size()));
      if (is_new) mesh.positions_m.push_back((mesh.positions_m[i] + mesh.positions_m[j]) / 2);
      return entry->second;
    };
    std::vector<std::array<uint32_t, 3>> finer;
    for (const auto& [i, j, k] : mesh.triangles) {
      const uint32_t ij = middle(i, j);
      const uint32_t jk = middle(j, k);
      const uint32_t ki = middle(k, i);
      for (const auto& triangle : {std::array{i, ij, ki}, {ij, j, jk}, {ki, jk, k}, {ij, jk, ki}}) {
        finer.push_back(triangle);
      }
    }
    mesh.triangles = std::move(finer);
    for (Vector3d& p : mesh.positions_m) p.normalize();
  }
  for (Vector3d& p : mesh.positions_m) p = radius * p.normalized();
  return mesh;
}

double LargestSagitta(const TriangleMesh& sphere, double radius) {
  double longest_sq = 0;
  for (const auto& triangle : sphere.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d edge =
          sphere.positions_m[triangle[(k + 1) % 3]] - sphere.positions_m[triangle[k]];
      longest_sq = std::max(longest_sq, edge.squaredNorm());
    }
  }
  // A triangle lies in a circle of radius at most longest edge / sqrt(3) (Jung).
  return radius - std::sqrt(radius * radius - longest_sq / 3);
}

TriangleMesh TorusMesh(double large_radius, double small_radius, uint32_t segments) {
  TriangleMesh mesh;
  const double turn = 2 * std::numbers::pi / segments;
  for (uint32_t u = 0; u < segments; ++u) {
    for (uint32_t v = 0; v < segments; ++v) {
      const double radius = large_radius + small_radius * std::cos(v * turn);
      mesh.positions_m.emplace_back(radius * std::cos(u * turn), small_radius * std::sin(v * turn),
                                    -radius * std::sin(u * turn));
      const auto at = [&](uint32_t i, uint32_t j) {
        return (u + i) % segments * segments + (v + j) % segments;
      };
      mesh.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
      mesh.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  }
  return mesh;
}

TriangleMesh TetrahedronMesh(double height) {
  return {.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, height}},
          .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

TriangleMesh Join(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh joined = a;
  const auto offset = static_cast<uint32_t>(a.positions_m.size());
  joined.positions_m.insert(joined.positions_m.end(), b.positions_m.begin(), b.positions_m.end());
  for (const auto& [i, j, k] : b.triangles) {
    joined.triangles.push_back({i + offset, j + offset, k + offset});
  }
  return joined;
}

TriangleMesh Reversed(TriangleMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

TriangleMesh Moved(TriangleMesh mesh, const Vector3d& by) {
  for (Vector3d& p : mesh.positions_m) p += by;
  return mesh;
}

double DistanceToTriangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                          const Vector3d& c) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return (p - a).norm();
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return (p - b).norm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (p - a - d1 / (d1 - d3) * ab).norm();
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return (p - c).norm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (p - a - d2 / (d2 - d6) * ac).norm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return (p - b - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).norm();
  }
  return (p - a - vb / (va + vb + vc) * ab - vc / (va + vb + vc) * ac).norm();
}

double BruteForceDistance(const TriangleMesh& mesh, const Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [i, j, k] : mesh.triangles) {
    nearest = std::min(nearest, DistanceToTriangle(p, mesh.positions_m[i], mesh.positions_m[j],
                                                   mesh.positions_m[k]));
  }
  return nearest;
}

double WindingNumber(const TriangleMesh& mesh, const Vector3d& p) {
  double half_angles = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3d a = mesh.positions_m[i] - p;
    const Vector3d b = mesh.positions_m[j] - p;
    const Vector3d c = mesh.positions_m[k] - p;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    half_angles +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles / (2 * std::numbers::pi);
}

double BruteForceSignedDistance(const TriangleMesh& mesh, const Vector3d& p) {
  const double distance = BruteForceDistance(mesh, p);
  return WindingNumber(mesh, p) > 0.5 ? -distance : distance;
}

namespace {

Eigen::Vector2d NearestOnSegment(const Eigen::Vector2d& p, const Eigen::Vector2d& from,
                                 const Eigen::Vector2d& to) {
  const Eigen::Vector2d way = to - from;
  return from + std::clamp((p - from).dot(way) / way.squaredNorm(), 0.0, 1.0) * way;
}

}  // namespace

CylinderPlace PlaceAtCylinder(const Vector3d& a, const Vector3d& b, double radius,
                              const Vector3d& p) {
  using Eigen::Vector2d;
  const double length = (b - a).norm();
  const Vector3d axis = (b - a) / length;
  const Vector3d across = axis.cross((p - a).cross(axis)).normalized();
  const Vector2d flat((p - a).dot(across), (p - a).dot(axis));  // from the axis, from a
  const Vector2d corners[] = {{0, 0}, {radius, 0}, {radius, length}, {0, length}};
  std::vector<std::pair<double, Vector2d>> bounds;
  for (size_t k = 0; k < 3; ++k) {
    const Vector2d nearest = NearestOnSegment(flat, corners[k], corners[k + 1]);
    bounds.emplace_back((flat - nearest).norm(), nearest);
  }
  std::sort(bounds.begin(), bounds.end(),
            [](const auto& one, const auto& other) { return one.first < other.first; });
  const bool is_inside = flat.x() < radius && flat.y() > 0 && flat.y() < length;
  const double sign = is_inside ? -1 : 1;
  const Vector2d outward = sign * (flat - bounds[0].second) / bounds[0].first;
  return {.distance = sign * bounds[0].first,
          .outward = outward.x() * across + outward.y() * axis,
          .lead = bounds[1].first - bounds[0].first};
}

Vector3d PointInBox(Random& random, const Vector3d& low, const Vector3d& high) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double x = unit(random);
  const double y = unit(random);
  const double z = unit(random);
  return low + Vector3d(x, y, z).cwiseProduct(high - low);
}

std::vector<Vector3d> PointsAround(const TriangleMesh& mesh, size_t count, double reach) {
  Random random(1);
  Vector3d low = mesh.positions_m[0];
  Vector3d high = low;
  for (const Vector3d& p : mesh.positions_m) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vector3d margin = Vector3d::Constant(reach);
  std::uniform_int_distribution<size_t> any_triangle(0, mesh.triangles.size() - 1);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    points.push_back(PointInBox(random, low - margin, high + margin));
    const auto& [i, j, k] = mesh.triangles[any_triangle(random)];
    const Vector3d weights = PointInBox(random, Vector3d::Constant(0.01), Vector3d::Ones());
    const Vector3d on_triangle =
        (weights.x() * mesh.positions_m[i] + weights.y() * mesh.positions_m[j] +
         weights.z() * mesh.positions_m[k]) /
        weights.sum();
    // Within a ball: the cube in it.
    points.push_back(on_triangle + PointInBox(random, -margin, margin) / std::sqrt(3.0));
  }
  return points;
}

}  // namespace drape::test
