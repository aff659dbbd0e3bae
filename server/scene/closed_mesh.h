// Meshes that enclose a volume: the conditions that make a triangle mesh a solid.
#pragma once

#include <cstdint>
#include <vector>

#include "server/core/status.h"
#include "server/scene/description.h"

namespace drape {

// Bounds on memory and time: a distance map of the largest mesh can take half a minute.
struct ClosedMeshLimits {
  uint32_t max_vertices = 1u << 17;
  uint32_t max_triangles = 1u << 17;
};

// Whether the mesh is the boundary of a solid, so that it has an inside and an outside: at least
// four triangles, none without area; each edge shared by exactly two triangles that run along it in
// opposite directions; around each vertex a single fan; a positive volume, so that the triangles
// are counter-clockwise seen from outside. Several parts, and cavities wound the other way, are
// fine; vertices of no triangle are ignored. Vertices at the same position with different indices
// are different: the seam between them is open. Fields as in CheckMeshValues; at most 16
// violations; empty = good.
std::vector<FieldViolation> CheckClosedMesh(const TriangleMesh& mesh,
                                            const ClosedMeshLimits& limits);

// Enclosed volume [m^3]; negative where the triangles are clockwise seen from outside.
double EnclosedVolume(const TriangleMesh& mesh);

// Half-edge 3 t + k runs from corner k of triangle t to corner k + 1 (mod 3); its twin is the same
// edge in the neighbour. [3 * triangle_count]. The mesh has passed CheckClosedMesh.
std::vector<uint32_t> TwinHalfEdges(const TriangleMesh& mesh);

}  // namespace drape
