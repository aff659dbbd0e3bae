#include "server/solver/self_contact/flat_sheet.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

namespace drape::self_contact {
namespace {

using Triangle = std::array<uint32_t, 3>;

// Limit on how far a corner is off the plane, over the size of the sheet, and on how far the
// boundary turns inwards [rad].
constexpr double kFlat = 1e-6;
// Off a full turn: the boundary goes around once, or more often [rad].
constexpr double kFullTurn = 1e-3;
// For rounding, of weights in single precision too [-].
constexpr double kCertain = 1e-3;

struct Plane {
  Vector3d origin, x, y;  // unit vectors

  std::array<double, 2> At(const Vector3d& p) const {
    const Vector3d d = p - origin;
    return {Dot(d, x), Dot(d, y)};
  }
};

std::optional<Plane> PlaneOf(std::span<const Vector3d> positions,
                             std::span<const Triangle> triangles) {
  Vector3d normal{};
  for (const auto& [i, j, k] : triangles) {
    normal += Cross(Vector3d(positions[j] - positions[i]), Vector3d(positions[k] - positions[i]));
  }
  const double length = Length(normal);
  if (!(length > 0)) return std::nullopt;
  normal /= length;
  const Vector3d origin = positions[triangles[0][0]];
  const Vector3d axis = std::abs(normal[0]) < 0.5 ? Vector3d{1, 0, 0, 0} : Vector3d{0, 1, 0, 0};
  Vector3d x = axis - Dot(axis, normal) * normal;
  x /= Length(x);
  double off = 0, size = 0;
  for (const Triangle& triangle : triangles) {
    for (const uint32_t i : triangle) {
      const Vector3d d = positions[i] - origin;
      off = std::max(off, std::abs(Dot(d, normal)));
      size = std::max(size, Length(d));
    }
  }
  if (off > kFlat * size) return std::nullopt;
  return Plane{origin, x, Cross(normal, x)};
}

// The corners of the boundary, once around; none: it is not one loop, or an edge has two triangles
// on one side.
std::vector<uint32_t> BoundaryOf(std::span<const Triangle> triangles) {
  using Edge = std::pair<uint32_t, uint32_t>;
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles) {
    for (int k = 0; k < 3; ++k) edges.emplace_back(triangle[k], triangle[(k + 1) % 3]);
  }
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end()) return {};
  std::map<uint32_t, uint32_t> next;
  for (const auto& [i, j] : edges) {
    if (std::ranges::binary_search(edges, Edge{j, i})) continue;
    if (!next.emplace(i, j).second) return {};
  }
  if (next.empty()) return {};
  std::vector<uint32_t> loop = {next.begin()->first};
  while (loop.size() <= next.size()) {
    const auto following = next.find(loop.back());
    if (following == next.end()) return {};
    if (following->second == loop.front()) break;
    loop.push_back(following->second);
  }
  if (loop.size() != next.size()) return {};
  return loop;
}

// A boundary that only turns to the left, once around, is that of a convex part of the plane, and
// triangles that all lie on its left side cover that once.
bool IsConvex(const std::vector<std::array<double, 2>>& loop) {
  double turned = 0;
  for (size_t k = 0; k < loop.size(); ++k) {
    const auto& a = loop[k];
    const auto& b = loop[(k + 1) % loop.size()];
    const auto& c = loop[(k + 2) % loop.size()];
    const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - b[0], vy = c[1] - b[1];
    const double turn = std::atan2(ux * vy - uy * vx, ux * vx + uy * vy);
    if (turn < -kFlat) return false;
    turned += turn;
  }
  return std::abs(turned - 2 * std::numbers::pi) < kFullTurn;
}

template <class V>
struct Columns {
  V first, second;

  ScalarOf<V> squared() const { return SquaredLength(first) + SquaredLength(second); }
  // The smaller singular value.
  ScalarOf<V> least() const {
    const ScalarOf<V> a = SquaredLength(first), b = Dot(first, second), c = SquaredLength(second);
    const ScalarOf<V> least_sq = (a + c - std::sqrt((a - c) * (a - c) + 4 * b * b)) / 2;
    return std::sqrt(std::max(least_sq, ScalarOf<V>{0}));
  }
};

}  // namespace

std::optional<FlatSheet> FlatSheet::Of(std::span<const Vector3d> rest_positions,
                                       std::span<const Triangle> triangles) {
  if (triangles.empty()) return std::nullopt;
  const std::optional<Plane> plane = PlaneOf(rest_positions, triangles);
  if (!plane) return std::nullopt;
  FlatSheet sheet;
  sheet.least_gap_m_ = std::numeric_limits<double>::max();
  std::vector<std::array<double, 2>> sums(rest_positions.size());  // of particles
  double double_area = 0;
  for (const Triangle& triangle : triangles) {
    const auto a = plane->At(rest_positions[triangle[0]]);
    const auto b = plane->At(rest_positions[triangle[1]]);
    const auto c = plane->At(rest_positions[triangle[2]]);
    const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    const double area = ux * vy - uy * vx;  // twice
    if (!(area > 0)) return std::nullopt;
    // The inverse of the matrix of its edges, times `area`.
    const std::array<double, 4> inverse = {vy, -uy, -vx, ux};
    Gradient& gradient = sheet.gradients_.emplace_back();
    gradient.corners = triangle;
    for (int k = 0; k < 4; ++k) gradient.weights[k] = static_cast<float>(inverse[k] / area);
    for (int column = 0; column < 2; ++column) {
      const double of_b = inverse[2 * column], of_c = inverse[2 * column + 1];
      sums[triangle[0]][column] -= of_b + of_c;
      sums[triangle[1]][column] += of_b;
      sums[triangle[2]][column] += of_c;
    }
    double_area += area;
    const double longest =
        std::max({std::hypot(ux, uy), std::hypot(vx, vy), std::hypot(vx - ux, vy - uy)});
    sheet.least_gap_m_ = std::min(sheet.least_gap_m_, area / longest);
  }
  const std::vector<uint32_t> boundary = BoundaryOf(triangles);
  std::vector<std::array<double, 2>> loop;
  for (const uint32_t i : boundary) loop.push_back(plane->At(rest_positions[i]));
  if (boundary.empty() || !IsConvex(loop)) return std::nullopt;
  for (const uint32_t i : boundary) {
    const auto& sum = sums[i];
    sheet.mean_.push_back(
        {i, {static_cast<float>(sum[0] / double_area), static_cast<float>(sum[1] / double_area)}});
  }
  return sheet;
}

template <class V>
bool FlatSheet::KeepsApart(std::span<const V> positions, std::span<const V> velocities,
                           ScalarOf<V> duration, ScalarOf<V> share) const {
  using Real = ScalarOf<V>;
  Columns<V> mean{};
  for (const OfMean& of : mean_) {
    const V p = positions[of.particle] - positions[mean_[0].particle];
    mean.first += static_cast<Real>(of.weights[0]) * p;
    mean.second += static_cast<Real>(of.weights[1]) * p;
  }
  const Real most = mean.least() - share - static_cast<Real>(kCertain);
  if (!(most > 0)) return false;
  const Real most_sq = most * most;
  const Real most_speed_sq = most_sq / (duration * duration);
  const auto columns_of = [](const Gradient& gradient, std::span<const V> values) {
    const V& origin = values[gradient.corners[0]];
    const V b = values[gradient.corners[1]] - origin, c = values[gradient.corners[2]] - origin;
    const auto& w = gradient.weights;
    return Columns<V>{static_cast<Real>(w[0]) * b + static_cast<Real>(w[1]) * c,
                      static_cast<Real>(w[2]) * b + static_cast<Real>(w[3]) * c};
  };
  Real off_sq = 0, fastest_sq = 0;
  for (const Gradient& gradient : gradients_) {
    const Columns<V> f = columns_of(gradient, positions);
    const Columns<V> off{f.first - mean.first, f.second - mean.second};
    const Real its_off_sq = off.squared();
    const Real its_speed_sq = columns_of(gradient, velocities).squared();
    // Also of what is not a number.
    if (!(its_off_sq < most_sq) || !(its_speed_sq < most_speed_sq)) return false;
    off_sq = std::max(off_sq, its_off_sq);
    fastest_sq = std::max(fastest_sq, its_speed_sq);
  }
  return std::sqrt(off_sq) + duration * std::sqrt(fastest_sq) < most;
}

template bool FlatSheet::KeepsApart<Vector3f>(std::span<const Vector3f>, std::span<const Vector3f>,
                                              float, float) const;
template bool FlatSheet::KeepsApart<Vector3d>(std::span<const Vector3d>, std::span<const Vector3d>,
                                              double, double) const;

}  // namespace drape::self_contact
