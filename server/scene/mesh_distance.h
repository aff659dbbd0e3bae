// Exact signed distance to the surface of a solid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/scene/description.h"
#include "server/scene/triangle_tree.h"

namespace drape {

struct SignedDistance {
  double distance_m = 0;  // negative inside
  uint32_t triangle = 0;  // a nearest one
};

// The distance is that to the nearest triangle. Its sign is that of the offset from the nearest
// point along the normal there: the normal of the face, the sum of both faces' normals at an edge,
// the angle-weighted sum at a vertex. So the sign is right whichever of several equally near
// triangles was found (Bærentzen & Aanæs 2005, «Signed distance computation using the angle
// weighted pseudonormal»). On a surface that crosses itself the sign is that of the nearest sheet.
// The mesh has passed CheckClosedMesh; it is not used after construction. Immutable; safe to share
// between threads.
class MeshDistance {
 public:
  explicit MeshDistance(const TriangleMesh& mesh);

  // `guess`: a triangle that is probably near; it only makes the search faster.
  SignedDistance At(const Eigen::Vector3d& p, std::optional<uint32_t> guess = {}) const;

 private:
  // Their lengths are arbitrary; only the directions matter.
  struct Pseudonormals {
    std::array<Eigen::Vector3d, 3> edges;
    std::array<Eigen::Vector3d, 3> corners;
  };
  const Eigen::Vector3d& NormalAt(const NearestTriangle& found) const;

  TriangleTree tree_;
  std::vector<Pseudonormals> pseudonormals_;  // [triangle_count]
};

}  // namespace drape
