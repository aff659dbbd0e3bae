// Mesh queries that the constraint builder needs.
#pragma once

#include "server/scene/description.h"

namespace drape {

// An undirected edge i < j and the vertices opposite it, one per adjacent triangle, in triangle
// order.
struct MeshEdge {
  uint32_t i = 0;
  uint32_t j = 0;
  std::vector<uint32_t> opposite_vertices;
};

// Unique edges in order of first appearance.
std::vector<MeshEdge> UniqueEdges(const std::vector<std::array<uint32_t, 3>>& triangles);

double TriangleArea(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// A repeated vertex, or an area below 1e-12 times the squared longest edge.
bool IsDegenerate(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle);

}  // namespace drape
