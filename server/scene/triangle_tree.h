// Bounding boxes in a binary tree: finds the triangle nearest to a point.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/scene/description.h"
#include "server/scene/triangle_distance.h"

namespace drape {

struct NearestTriangle {
  uint32_t triangle = 0;
  NearestOnTriangle nearest;
};

// Immutable; safe to share between threads. About 200 bytes per triangle. The mesh has at least one
// triangle and none of them is degenerate; it is not used after construction.
class TriangleTree {
 public:
  explicit TriangleTree(const TriangleMesh& mesh);

  // `guess`: a triangle that is probably near; it only makes the search faster. Among equally near
  // triangles the first one found, which is always the same for the same arguments.
  NearestTriangle Nearest(const Eigen::Vector3d& p, std::optional<uint32_t> guess = {}) const;

  const TriangleGeometry& triangle(uint32_t index) const { return triangles_[place_[index]]; }

 private:
  struct Box {
    Eigen::Array3d low_m = Eigen::Array3d::Zero();
    Eigen::Array3d high_m = Eigen::Array3d::Zero();
    double DistanceSq(const Eigen::Vector3d& p) const {
      double sum = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double outside =
            std::max(std::max(low_m[axis] - p[axis], p[axis] - high_m[axis]), 0.0);
        sum += outside * outside;
      }
      return sum;
    }
  };
  struct Node {
    Box box;
    // Leaf: triangles_[first .. first + count). Inner: count 0, children nodes_[first], [first+1].
    uint32_t first = 0;
    uint32_t count = 0;
  };

  void Split(uint32_t node, const std::vector<Eigen::Array3d>& centers);
  void SetBoxes();

  std::vector<Node> nodes_;
  std::vector<TriangleGeometry> triangles_;  // in the order of the leaves
  std::vector<uint32_t> index_;              // mesh's index of triangles_[k]
  std::vector<uint32_t> place_;              // inverse of index_
};

}  // namespace drape
