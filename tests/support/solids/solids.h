// Closed meshes for tests, and their distances by other code than the server's.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "server/scene/description.h"

namespace drape::test {

TriangleMesh BoxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
// All vertices on the sphere around the origin; 20 * 4^subdivisions triangles.
TriangleMesh SphereMesh(double radius, int subdivisions);
// How far the triangles of a mesh, with its corners on a sphere, are from that sphere at most.
double LargestSagitta(const TriangleMesh& sphere, double radius);
TriangleMesh TorusMesh(double large_radius, double small_radius, uint32_t segments);
// Corners (0,0,0), (1,0,0), (0,1,0) and (0.3, 0.3, height): sharp edges for small heights.
TriangleMesh TetrahedronMesh(double height);

TriangleMesh Join(const TriangleMesh& a, const TriangleMesh& b);
TriangleMesh Reversed(TriangleMesh mesh);
TriangleMesh Moved(TriangleMesh mesh, const Eigen::Vector3d& by);

// Nearest point by barycentric regions (Ericson 2004, «Real-Time Collision Detection», 5.1.5).
double DistanceToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c);
// Over all triangles.
double BruteForceDistance(const TriangleMesh& mesh, const Eigen::Vector3d& p);
// Solid angles over 4 pi (Van Oosterom & Strackee 1983): 1 inside, 0 outside.
double WindingNumber(const TriangleMesh& mesh, const Eigen::Vector3d& p);
// Brute force, negative where the winding number is above one half.
double BruteForceSignedDistance(const TriangleMesh& mesh, const Eigen::Vector3d& p);

// The place of a point relative to a solid cylinder; a and b are the middles of its flat ends.
struct CylinderPlace {
  double distance = 0;      // negative inside
  Eigen::Vector3d outward;  // unit, away from the nearest point or, inside, towards it
  // How much farther the side, the nearer or the farther end is than the nearest of the three:
  // where it is 0 the outward direction jumps inside.
  double lead = 0;
};
// By the nearest points of the three line segments that bound a cylinder in the half-plane through
// its axis and p, which is not on the axis.
CylinderPlace PlaceAtCylinder(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius,
                              const Eigen::Vector3d& p);

using Random = std::mt19937_64;
Eigen::Vector3d PointInBox(Random& random, const Eigen::Vector3d& low, const Eigen::Vector3d& high);
// Half of them uniform in the mesh's bounding box grown by `reach`, half within `reach` of a
// uniformly chosen triangle.
std::vector<Eigen::Vector3d> PointsAround(const TriangleMesh& mesh, size_t count, double reach);

}  // namespace drape::test
