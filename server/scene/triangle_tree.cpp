#include "server/scene/triangle_tree.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "server/core/check.h"

namespace drape {
namespace {

using Eigen::Array3d;
using Eigen::Vector3d;

constexpr uint32_t kTrianglesPerLeaf = 4;
// Halving 2^32 triangles ends within 32 levels; a visit leaves at most one node per level behind.
constexpr size_t kMaxPending = 64;

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
  const size_t count = mesh.triangles.size();
  DRAPE_CHECK(count > 0, "a tree of no triangles");
  index_.resize(count);
  std::iota(index_.begin(), index_.end(), 0u);
  std::vector<TriangleGeometry> in_mesh_order;
  std::vector<Array3d> centers;
  in_mesh_order.reserve(count);
  centers.reserve(count);
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3d& a = mesh.positions_m[i];
    const Vector3d& b = mesh.positions_m[j];
    const Vector3d& c = mesh.positions_m[k];
    in_mesh_order.push_back(MakeTriangleGeometry(a, b, c));
    centers.push_back((a + b + c).array() / 3);
  }
  nodes_.reserve(2 * count / kTrianglesPerLeaf + 2);
  nodes_.push_back({.box = {}, .first = 0, .count = static_cast<uint32_t>(count)});
  Split(0, centers);
  place_.resize(count);
  triangles_.reserve(count);
  for (uint32_t place = 0; place < count; ++place) {
    place_[index_[place]] = place;
    triangles_.push_back(in_mesh_order[index_[place]]);
  }
  SetBoxes();
}

// Halves the triangles of `node` at the median of the axis along which their centres spread most.
void TriangleTree::Split(uint32_t node, const std::vector<Array3d>& centers) {
  const uint32_t first = nodes_[node].first;
  const uint32_t count = nodes_[node].count;
  if (count <= kTrianglesPerLeaf) return;
  Array3d low = centers[index_[first]];
  Array3d high = low;
  for (uint32_t k = first; k < first + count; ++k) {
    low = low.min(centers[index_[k]]);
    high = high.max(centers[index_[k]]);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const uint32_t half = count / 2;
  const auto begin = index_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](uint32_t a, uint32_t b) {
    return centers[a][axis] < centers[b][axis] || (centers[a][axis] == centers[b][axis] && a < b);
  });
  const auto children = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back({.box = {}, .first = first, .count = half});
  nodes_.push_back({.box = {}, .first = first + half, .count = count - half});
  nodes_[node].first = children;
  nodes_[node].count = 0;
  Split(children, centers);
  Split(children + 1, centers);
}

// Children follow their parents, so a pass from the back finds the boxes of the children first.
void TriangleTree::SetBoxes() {
  for (size_t k = nodes_.size(); k-- > 0;) {
    Node& node = nodes_[k];
    if (node.count == 0) {
      const Box& left = nodes_[node.first].box;
      const Box& right = nodes_[node.first + 1].box;
      node.box = {left.low_m.min(right.low_m), left.high_m.max(right.high_m)};
      continue;
    }
    node.box = {Array3d::Constant(std::numeric_limits<double>::infinity()),
                Array3d::Constant(-std::numeric_limits<double>::infinity())};
    for (uint32_t t = node.first; t < node.first + node.count; ++t) {
      for (const Vector3d& corner : triangles_[t].corners_m) {
        node.box.low_m = node.box.low_m.min(corner.array());
        node.box.high_m = node.box.high_m.max(corner.array());
      }
    }
  }
}

NearestTriangle TriangleTree::Nearest(const Vector3d& p, std::optional<uint32_t> guess) const {
  NearestTriangle best;
  best.triangle = guess.value_or(index_[0]);
  best.nearest = NearestPoint(triangle(best.triangle), p);

  struct Pending {
    uint32_t node;
    double distance_sq;
  };
  std::array<Pending, kMaxPending> pending;
  size_t pending_count = 0;
  pending[pending_count++] = {0, nodes_[0].box.DistanceSq(p)};
  while (pending_count > 0) {
    const Pending next = pending[--pending_count];
    if (next.distance_sq >= best.nearest.distance_sq) continue;
    const Node& node = nodes_[next.node];
    if (node.count > 0) {
      for (uint32_t t = node.first; t < node.first + node.count; ++t) {
        const TriangleGeometry& candidate = triangles_[t];
        const double height = candidate.normal.dot(p - candidate.corners_m[0]);
        if (height * height >= best.nearest.distance_sq) continue;  // of its whole plane
        const NearestOnTriangle nearest = NearestPoint(candidate, p);
        if (nearest.distance_sq < best.nearest.distance_sq) best = {index_[t], nearest};
      }
      continue;
    }
    Pending near = {node.first, nodes_[node.first].box.DistanceSq(p)};
    Pending far = {node.first + 1, nodes_[node.first + 1].box.DistanceSq(p)};
    if (far.distance_sq < near.distance_sq) std::swap(near, far);
    if (far.distance_sq < best.nearest.distance_sq) pending[pending_count++] = far;
    if (near.distance_sq < best.nearest.distance_sq) pending[pending_count++] = near;
  }
  return best;
}

}  // namespace drape
