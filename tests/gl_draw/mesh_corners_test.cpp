#include "server/render/gl_draw/mesh_corners.h"

#include <gtest/gtest.h>

#include "tests/support/solids/solids.h"

namespace drape::render {
namespace {

using Eigen::Vector3d;

struct Corner {
  Vector3d position_m;
  Vector3d normal;
};

std::vector<Corner> Corners(const TriangleMesh& mesh, const Vector3d& center_m, double inset_m) {
  const std::vector<float> words = MeshCorners(mesh, center_m, inset_m);
  EXPECT_EQ(words.size(), 18 * mesh.triangles.size());
  std::vector<Corner> corners;
  for (size_t k = 0; k + 5 < words.size(); k += 6) {
    corners.push_back(
        {{words[k], words[k + 1], words[k + 2]}, {words[k + 3], words[k + 4], words[k + 5]}});
  }
  return corners;
}

TEST(MeshCornersTest, ABoxKeepsItsEdgesSharp) {
  const TriangleMesh box = test::BoxMesh({1, 2, 3}, {3, 4, 5});
  for (const Corner& corner : Corners(box, {2, 3, 4}, 0)) {
    EXPECT_EQ(corner.position_m.cwiseAbs(), Vector3d::Ones());
    EXPECT_EQ(corner.normal.cwiseAbs().sum(), 1) << "the normal of a face";
    EXPECT_EQ(corner.normal.dot(corner.position_m), 1) << "outwards";
  }
}

TEST(MeshCornersTest, ABallIsSmoothAndShrinks) {
  // Mean normals of vertices are off the radius by less than the edges are long.
  const TriangleMesh ball = test::SphereMesh(1, 3);
  for (const Corner& corner : Corners(ball, Vector3d::Zero(), 0.125)) {
    EXPECT_NEAR(corner.position_m.norm(), 0.875, 0.002);
    EXPECT_LT((corner.normal - corner.position_m.normalized()).norm(), 0.1);
    EXPECT_NEAR(corner.normal.norm(), 1, 1e-6);
  }
}

// A cone with very many faces around its tip: taking the mean for each face would cost the square
// of their number.
TEST(MeshCornersTest, AroundAVertexOfManyFacesNormalsAreTheFaces) {
  constexpr uint32_t kFaces = 200;
  TriangleMesh cone;
  cone.positions_m = {{0, 1, 0}, {0, 0, 0}};
  for (uint32_t k = 0; k < kFaces; ++k) {
    const double angle = 2 * M_PI * k / kFaces;
    cone.positions_m.emplace_back(std::sin(angle), 0, std::cos(angle));
  }
  for (uint32_t k = 0; k < kFaces; ++k) {
    const uint32_t here = 2 + k, next = 2 + (k + 1) % kFaces;
    cone.triangles.push_back({0, here, next});
    cone.triangles.push_back({1, next, here});
  }
  const std::vector<Corner> corners = Corners(cone, Vector3d::Zero(), 0);
  EXPECT_NEAR(corners[0].normal.y(), std::sqrt(0.5), 1e-3);
  EXPECT_GT(corners[0].normal.z(), 0.7);
  EXPECT_LT(corners[0].normal.x(), 0.1);
}

}  // namespace
}  // namespace drape::render
