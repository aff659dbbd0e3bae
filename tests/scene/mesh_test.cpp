#include "server/scene/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <unordered_map>

namespace drape {
namespace {

using ::testing::ElementsAre;

TEST(UniqueEdges, TwoTrianglesShareTheirEdge) {
  // 0-1-2 and 2-1-3, the shared edge 1-2 is met in opposite directions.
  const auto edges = UniqueEdges({{0, 1, 2}, {2, 1, 3}});
  ASSERT_EQ(edges.size(), 5u);
  EXPECT_EQ(edges[0].i, 0u);
  EXPECT_EQ(edges[0].j, 1u);
  EXPECT_THAT(edges[0].opposite_vertices, ElementsAre(2));
  EXPECT_EQ(edges[1].i, 1u);
  EXPECT_EQ(edges[1].j, 2u);
  EXPECT_THAT(edges[1].opposite_vertices, ElementsAre(0, 3));
}

TEST(UniqueEdges, AnEdgeOfThreeTrianglesHasThreeOppositeVertices) {
  const auto edges = UniqueEdges({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  ASSERT_EQ(edges.size(), 7u);
  EXPECT_THAT(edges[0].opposite_vertices, ElementsAre(2, 3, 4));
}

TEST(UniqueEdges, IndicesBeyondThirtyTwoBitsOfKeyDoNotCollide) {
  const auto edges = UniqueEdges({{0xffffffffu, 0, 1}, {0xfffffffeu, 1, 2}});
  EXPECT_EQ(edges.size(), 6u);
}

// Of two numbers of vertices, the second one is chosen so that all these edges would be in one
// bucket of a table that hashes them to themselves: seconds here, in place of milliseconds.
TEST(UniqueEdges, ClientsCannotChooseEdgesThatShareABucket) {
  constexpr uint64_t kTriangles = 80'000, kVertices = 240'000;
  std::unordered_map<uint64_t, uint32_t> plain;
  plain.reserve(kTriangles * 3 / 2);
  const uint64_t buckets = plain.bucket_count();
  std::vector<std::array<uint32_t, 3>> triangles;
  for (uint64_t i = 0; i < kVertices && triangles.size() < kTriangles / 2; ++i) {
    const uint64_t j = buckets - (i << 32) % buckets;
    if (j <= i + 1 || j >= kVertices) continue;
    triangles.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(j), uint32_t(i + 1)});
  }
  ASSERT_EQ(triangles.size(), kTriangles / 2);
  // As many others, for the size of the table.
  for (uint32_t i = 0; triangles.size() < kTriangles; ++i) triangles.push_back({i, i + 1, i + 2});
  const auto time_s = [&] {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_GT(UniqueEdges(triangles).size(), kTriangles);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const double chosen_s = time_s();
  for (size_t t = 0; t < kTriangles / 2; ++t) triangles[t][1] = triangles[t][2] + uint32_t(t % 97);
  EXPECT_LT(chosen_s, 0.1 + 20 * time_s());
}

TEST(TriangleArea, OfAKnownTriangle) {
  EXPECT_DOUBLE_EQ(TriangleArea({0, 0, 0}, {3, 0, 0}, {0, 0, 4}), 6);
}

TEST(IsDegenerate, TellsZeroAreaFromSlender) {
  TriangleMesh mesh;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1e-9, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_FALSE(IsDegenerate(mesh, {0, 1, 5}));
  EXPECT_TRUE(IsDegenerate(mesh, {0, 1, 1})) << "a repeated vertex";
  EXPECT_TRUE(IsDegenerate(mesh, {0, 1, 2})) << "in a line";
  EXPECT_TRUE(IsDegenerate(mesh, {0, 1, 4})) << "two vertices in one place";
  // Area 1e-9 of a longest edge of 2: ratio 2.5e-10, above 1e-12.
  EXPECT_FALSE(IsDegenerate(mesh, {0, 3, 2})) << "slender";
}

TEST(IsDegenerate, DoesNotDependOnTheUnit) {
  for (const double scale : {1e-6, 1e-3, 1.0, 1e5}) {
    TriangleMesh mesh;
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                                     Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(2, 0, 0)}) {
      mesh.positions_m.push_back(scale * p);
    }
    EXPECT_FALSE(IsDegenerate(mesh, {0, 1, 2})) << scale;
    EXPECT_TRUE(IsDegenerate(mesh, {0, 1, 3})) << scale;
  }
}

}  // namespace
}  // namespace drape
