#include "server/scene/mesh_distance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/obj_file.h"
#include "tests/support/paths/paths.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Largest difference from brute force, which counts the winding for its sign; on the surface itself
// (nearer than rounding) either sign is right.
void ExpectExact(const TriangleMesh& mesh, size_t point_count, double reach) {
  const MeshDistance distance(mesh);
  for (const Vector3d& p : PointsAround(mesh, point_count, reach)) {
    ASSERT_NEAR(distance.At(p).distance_m, BruteForceSignedDistance(mesh, p),
                1e-12 * (1 + p.norm()))
        << "at " << p.transpose();
  }
}

TEST(MeshDistanceTest, OfABoxIsTheClosedForm) {
  const Vector3d half(0.5, 1, 1.5);
  const MeshDistance distance(BoxMesh(-half, half));
  Random random(1);
  for (int k = 0; k < 2000; ++k) {
    const Vector3d p = PointInBox(random, -2 * half, 2 * half);
    const Vector3d beyond = p.cwiseAbs() - half;
    const double exact = beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
    EXPECT_NEAR(distance.At(p).distance_m, exact, 1e-14) << p.transpose();
  }
}

TEST(MeshDistanceTest, OfASphereIsThatOfItsRadiusWithinTheSagittaOfItsTriangles) {
  const double radius = 0.7;
  const TriangleMesh mesh = SphereMesh(radius, 3);
  const double sagitta = LargestSagitta(mesh, radius);
  const MeshDistance distance(mesh);
  for (const Vector3d& p : PointsAround(mesh, 2000, 0.3)) {
    const double from_sphere = distance.At(p).distance_m - (p.norm() - radius);
    EXPECT_GE(from_sphere, -1e-13);
    EXPECT_LE(from_sphere, sagitta + 1e-13);
  }
}

// If the nearest point is on an edge or vertex, the normal of one of its faces gives the wrong side
// for some points; sharp edges show it.
TEST(MeshDistanceTest, SignHoldsAtSharpEdgesAndVertices) {
  ExpectExact(TetrahedronMesh(1), 500, 0.5);
  ExpectExact(TetrahedronMesh(0.05), 500, 0.3);
  ExpectExact(TetrahedronMesh(0.001), 500, 0.01);
  // A saddle at each inner vertex.
  ExpectExact(TorusMesh(1, 0.6, 9), 500, 0.5);
}

TEST(MeshDistanceTest, PartsAndCavities) {
  ExpectExact(Join(BoxMesh({0, 0, 0}, {1, 1, 1}), BoxMesh({1.2, 0, 0}, {2, 1, 1})), 500, 0.3);
  const TriangleMesh hollow = Join(SphereMesh(1, 2), Reversed(SphereMesh(0.5, 1)));
  ExpectExact(hollow, 500, 0.3);
  EXPECT_GT(MeshDistance(hollow).At(Vector3d::Zero()).distance_m, 0.3);
}

TEST(MeshDistanceTest, ATableHasAnInside) {
  ExpectExact(ReadObj(SourcePath("client/examples/meshes/table.obj"), 1.0), 100, 0.05);
}

// The 10^4 points of the two real meshes: the table has a sliver of aspect 45, the body
// fingers, ears and two slivers.
TEST(MeshDistanceLong, TableAtTenThousandPoints) {
  ExpectExact(ReadObj(SourcePath("client/examples/meshes/table.obj"), 1.0), 10'000, 0.05);
}

TEST(MeshDistanceLong, BodyAtTenThousandPoints) {
  ExpectExact(ReadObj(SourcePath("client/examples/meshes/body_male.obj"), 0.1), 10'000, 0.1);
}

}  // namespace
}  // namespace drape::test
