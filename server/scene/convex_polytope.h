// Convex solids with few flat faces: crates, wedges, prisms, dice. Pure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/scene/description.h"

namespace drape {

struct ConvexPolytope {
  struct Face {
    Eigen::Vector3d normal;         // outward, unit
    std::vector<uint32_t> corners;  // counter-clockwise seen from outside
  };

  std::vector<Eigen::Vector3d> corners_m;
  std::vector<Face> faces;
  std::vector<Eigen::Vector3d> edge_directions;  // unit, each once

  uint64_t size_bytes() const;

  // Most faces, and most corners of one. Contacts of two solids try each face, and each edge of one
  // with each of the other, so what has more costs too much; it is rounder, too.
  static constexpr size_t kMostFaces = 24;
  static constexpr size_t kMostCornersOfFace = 24;
};

// Of a closed mesh with outward normals; null if it is not convex, or has more faces. Triangles
// that are in one plane are one face; positions agree within kFlatness of the mesh's size.
std::shared_ptr<const ConvexPolytope> PolytopeOf(const TriangleMesh& mesh);

}  // namespace drape
