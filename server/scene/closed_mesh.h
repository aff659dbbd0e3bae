// Meshes that enclose a volume: the conditions that make a triangle mesh a solid.
#pragma once

#include <Eigen/Core>
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

// Volume, and first and second moments of a solid of density 1.
struct SolidMoments {
  double volume_m3 = 0;
  Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();
  // Integral of (x - centroid)(x - centroid)^T [m^5].
  Eigen::Matrix3d second_m5 = Eigen::Matrix3d::Zero();
  double radius_m = 0;  // of the ball around the centroid that holds the solid
};

// Of what the mesh encloses: sums over the tetrahedra between one point and its triangles, exact
// but for rounding (Eberly 2002, «Polyhedral mass properties (revisited)»).
SolidMoments MomentsOf(const TriangleMesh& mesh);

// The vertices that are farthest along each of `directions` directions, evenly spread over a sphere
// (Fibonacci's spiral); each once, in the order of their indices.
std::vector<Eigen::Vector3d> OutermostVertices(const TriangleMesh& mesh, int directions);

// Half-edge 3 t + k runs from corner k of triangle t to corner k + 1 (mod 3); its twin is the same
// edge in the neighbour. [3 * triangle_count]. The mesh has passed CheckClosedMesh.
std::vector<uint32_t> TwinHalfEdges(const TriangleMesh& mesh);

}  // namespace drape
