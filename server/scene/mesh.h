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

// Of one edge. No cloth is sewn of so many sheets, and what looks at pairs of them takes the square
// of their number.
inline constexpr size_t kMaxTrianglesAtEdge = 64;

// The pairs of triangles that are one sheet across the edge, by the vertices opposite it. Where
// more than two meet, each goes on with the one that continues it most straightly, and one that is
// left over hangs at the edge by itself. A pair of the same vertex, a triangle drawn twice, is left
// out.
std::vector<std::array<uint32_t, 2>> SheetsAcross(const MeshEdge& edge,
                                                  const std::vector<Eigen::Vector3d>& positions_m);

// Unique edges in order of first appearance.
std::vector<MeshEdge> UniqueEdges(const std::vector<std::array<uint32_t, 3>>& triangles);

double TriangleArea(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// A repeated vertex, or an area below 1e-12 times the squared longest edge.
bool IsDegenerate(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle);

}  // namespace drape
