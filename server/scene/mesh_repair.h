// Repairs a mesh of cloth: what a drawing may have and a simulation should not (mesh_import.md).
#pragma once

#include <cstdint>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/description.h"

namespace drape {

// The length that an edge of a mesh typically exceeds [m]: nine of ten edges are at least as long.
// A defect is rare, so it does not decide; a mesh that is fine in parts has many short edges.
// 0 for a mesh without edges.
double LeastTypicalEdge_m(const TriangleMesh& mesh);

// Vertices of the border that are nearer to each other than this share of LeastTypicalEdge_m() are
// one [-]: the rounding of coordinates in a file, not a gap.
inline constexpr double kWeldShare = 1e-3;
// Edges shorter than this share of LeastTypicalEdge_m() are collapsed [-]. What a solver leaves at
// the ends of a link does not depend on its length: the strain of such an edge is twenty times that
// of its neighbours. Larger: vertices that show would move.
inline constexpr double kCollapseShare = 0.05;
// Triangles lower than this share of their longest edge, with the apex above that edge, are caps
// [-]: the edge spans the vertex, and locks the fold that the two other edges would make there.
inline constexpr double kCapShare = 0.05;

// What was done.
struct MeshRepairCounts {
  uint32_t welded_vertices = 0;     // of the border, onto others at the same place
  uint32_t collapsed_vertices = 0;  // at short edges, onto others
  double largest_shift_m = 0;       // of a vertex from where it was drawn
  uint32_t flipped_edges = 0;       // of caps
  uint32_t dropped_triangles = 0;   // without area, collapsed, drawn twice, caps at the border
  uint32_t turned_triangles = 0;    // wound against their neighbours
  uint32_t non_manifold_edges = 0;  // of more than two triangles; they stay
  uint32_t loose_vertices = 0;      // of no triangle that is left, as drawn; they stay

  bool operator==(const MeshRepairCounts&) const = default;
};

struct RepairedMesh {
  TriangleMesh mesh;
  // [vertex_count as drawn] the vertex of `mesh` that stands for each; empty: itself. Ascending by
  // the first of the vertices that it stands for.
  std::vector<uint32_t> vertex_of_drawn;
  MeshRepairCounts counts;
};

// The corners are indices of positions that are finite. A pure function; about linear time. A mesh
// without defects keeps all its bits.
// `interruption`: asked between its stages; null: nobody is.
RepairedMesh RepairMesh(const TriangleMesh& drawn, Interruption* interruption = nullptr);

}  // namespace drape
