#include "server/scene/convex_polytope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Turned and moved, with the rounding of single precision, as files have it.
TriangleMesh AsInAFile(TriangleMesh mesh) {
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized()));
  for (Vector3d& p : mesh.positions_m) {
    p = (turned * p + Vector3d(3, -1, 2)).cast<float>().cast<double>();
  }
  return mesh;
}

// Its sides are squares of `cells` by `cells`, each of two triangles.
TriangleMesh FineBox(uint32_t cells) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto first = static_cast<uint32_t>(mesh.positions_m.size());
      for (uint32_t i = 0; i <= cells; ++i) {
        for (uint32_t j = 0; j <= cells; ++j) {
          Vector3d p;
          p[axis] = side;
          p[(axis + 1) % 3] = side * (2.0 * i / cells - 1);
          p[(axis + 2) % 3] = 2.0 * j / cells - 1;
          mesh.positions_m.push_back(p);
        }
      }
      for (uint32_t i = 0; i < cells; ++i) {
        for (uint32_t j = 0; j < cells; ++j) {
          const uint32_t a = first + i * (cells + 1) + j, b = a + cells + 1;
          mesh.triangles.push_back({a, b, b + 1});
          mesh.triangles.push_back({a, b + 1, a + 1});
        }
      }
    }
  }
  return mesh;
}

void ExpectBox(const TriangleMesh& mesh) {
  const auto polytope = PolytopeOf(mesh);
  ASSERT_TRUE(polytope);
  EXPECT_EQ(polytope->faces.size(), 6u);
  EXPECT_EQ(polytope->edge_directions.size(), 3u);
  for (const auto& face : polytope->faces) {
    ASSERT_EQ(face.corners.size(), 4u);
    const Vector3d& a = polytope->corners_m[face.corners[0]];
    const Vector3d& b = polytope->corners_m[face.corners[1]];
    const Vector3d& c = polytope->corners_m[face.corners[2]];
    EXPECT_GT((b - a).cross(c - b).normalized().dot(face.normal), 1 - 1e-9);
    for (const Vector3d& corner : polytope->corners_m) {
      EXPECT_LE(face.normal.dot(corner - a), 1e-6 * (c - a).norm());
    }
  }
}

TEST(ConvexPolytope, KnowsABoxByItsTriangles) {
  ExpectBox(BoxMesh({-1, -2, -3}, {1, 2, 3}));
  ExpectBox(AsInAFile(BoxMesh({-1, -2, -3}, {1, 2, 3})));
  EXPECT_EQ(PolytopeOf(BoxMesh({-1, -2, -3}, {1, 2, 3}))->corners_m.size(), 8u);
}

TEST(ConvexPolytope, TrianglesOfOnePlaneAreOneFace) {
  ExpectBox(FineBox(1));
  ExpectBox(FineBox(7));
  ExpectBox(AsInAFile(FineBox(7)));
}

TEST(ConvexPolytope, KnowsATetrahedron) {
  TriangleMesh mesh;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const auto polytope = PolytopeOf(AsInAFile(mesh));
  ASSERT_TRUE(polytope);
  EXPECT_EQ(polytope->faces.size(), 4u);
  EXPECT_EQ(polytope->corners_m.size(), 4u);
  EXPECT_EQ(polytope->edge_directions.size(), 6u);
}

// A dent of a thousandth of the size, and what is round.
TEST(ConvexPolytope, KnowsWhatItIsNot) {
  TriangleMesh dented = FineBox(2);
  for (Vector3d& p : dented.positions_m) {
    if (p == Vector3d(1, 0, 0)) p.x() = 0.999;
  }
  EXPECT_FALSE(PolytopeOf(dented));
  EXPECT_FALSE(PolytopeOf(SphereMesh(1, 2)));
}

}  // namespace
}  // namespace drape::test
