#include "server/scene/triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class TriangleTreeTest : public ::testing::TestWithParam<TriangleMesh> {};

TEST_P(TriangleTreeTest, FindsWhatBruteForceFinds) {
  const TriangleMesh& mesh = GetParam();
  const TriangleTree tree(mesh);
  for (const Vector3d& p : PointsAround(mesh, 300, 0.5)) {
    const NearestTriangle found = tree.Nearest(p);
    EXPECT_NEAR(std::sqrt(found.nearest.distance_sq), BruteForceDistance(mesh, p), 1e-13);
    const auto& [i, j, k] = mesh.triangles.at(found.triangle);
    EXPECT_NEAR(
        DistanceToTriangle(p, mesh.positions_m[i], mesh.positions_m[j], mesh.positions_m[k]),
        std::sqrt(found.nearest.distance_sq), 1e-13)
        << "names another triangle than it measured";
  }
}

TEST_P(TriangleTreeTest, AWrongGuessCostsTimeOnly) {
  const TriangleMesh& mesh = GetParam();
  const TriangleTree tree(mesh);
  const auto count = static_cast<uint32_t>(mesh.triangles.size());
  uint32_t guess = 0;
  for (const Vector3d& p : PointsAround(mesh, 100, 0.5)) {
    guess = (guess + 7919) % count;
    EXPECT_EQ(tree.Nearest(p, guess).nearest.distance_sq, tree.Nearest(p).nearest.distance_sq);
  }
}

TEST_P(TriangleTreeTest, KeepsTheMeshsNumbers) {
  const TriangleMesh& mesh = GetParam();
  const TriangleTree tree(mesh);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(tree.triangle(t).corners_m[k], mesh.positions_m[mesh.triangles[t][k]]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Meshes, TriangleTreeTest,
    ::testing::Values(TriangleMesh{.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                   .triangles = {{0, 1, 2}}},
                      BoxMesh({0, 0, 0}, {1, 2, 3}), SphereMesh(1, 2), TorusMesh(1, 0.3, 24),
                      // Equal centres: nothing to split by but the index.
                      Join(BoxMesh({0, 0, 0}, {1, 1, 1}), BoxMesh({0, 0, 0}, {1, 1, 1}))));

}  // namespace
}  // namespace drape::test
