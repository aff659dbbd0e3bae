#include "server/scene/closed_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

auto Violation(const std::string& field, const std::string& part) {
  return AllOf(Field(&FieldViolation::field, field),
               Field(&FieldViolation::description, HasSubstr(part)));
}

std::vector<FieldViolation> Check(const TriangleMesh& mesh) {
  return CheckClosedMesh(mesh, {});
}

TriangleMesh Box() {
  return BoxMesh({0, 0, 0}, {1, 2, 3});
}

TEST(ClosedMeshTest, AcceptsSolids) {
  EXPECT_THAT(Check(Box()), IsEmpty());
  EXPECT_THAT(Check(SphereMesh(0.5, 3)), IsEmpty());
  EXPECT_THAT(Check(TorusMesh(1, 0.3, 16)), IsEmpty());
  EXPECT_THAT(Check(TetrahedronMesh(1e-3)), IsEmpty());
}

TEST(ClosedMeshTest, AcceptsSeveralPartsCavitiesAndUnusedVertices) {
  EXPECT_THAT(Check(Join(Box(), Moved(Box(), {5, 0, 0}))), IsEmpty());
  EXPECT_THAT(Check(Join(SphereMesh(1, 2), Reversed(SphereMesh(0.5, 2)))), IsEmpty());
  TriangleMesh mesh = Box();
  mesh.positions_m.emplace_back(100, 100, 100);
  EXPECT_THAT(Check(mesh), IsEmpty());
}

TEST(ClosedMeshTest, NamesBothSidesOfAHole) {
  TriangleMesh mesh = Box();
  mesh.triangles.erase(mesh.triangles.begin() + 4);  // 0 1 5
  EXPECT_THAT(Check(mesh),
              ElementsAre(Violation("mesh.triangles[1]", "edge 0-1 belongs to 1 triangle;"),
                          Violation("mesh.triangles[4]", "edge 0-5 belongs to 1 triangle;"),
                          Violation("mesh.triangles[10]", "edge 1-5 belongs to 1 triangle;")));
}

TEST(ClosedMeshTest, AHoleAllOverIsToldInAtMostSixteenLines) {
  TriangleMesh mesh = SphereMesh(1, 2);
  for (auto& triangle : mesh.triangles) {  // each with vertices of its own
    for (uint32_t& vertex : triangle) {
      mesh.positions_m.push_back(mesh.positions_m[vertex]);
      vertex = static_cast<uint32_t>(mesh.positions_m.size()) - 1;
    }
  }
  EXPECT_THAT(Check(mesh), SizeIs(16));
}

TEST(ClosedMeshTest, RefusesAFinOnAnEdge) {
  TriangleMesh mesh = Box();
  mesh.positions_m.emplace_back(-1, -1, 0.5);
  mesh.triangles.push_back({0, 4, 8});
  EXPECT_THAT(Check(mesh), Contains(Violation("mesh.triangles[5]", "belongs to 3 triangles")));
}

TEST(ClosedMeshTest, RefusesATriangleWoundAgainstItsNeighbours) {
  TriangleMesh mesh = Box();
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  const auto violations = Check(mesh);
  EXPECT_THAT(violations, SizeIs(3));
  EXPECT_THAT(violations, Contains(Violation("mesh.triangles[7]", "the same way as triangle 6")));
}

TEST(ClosedMeshTest, RefusesAMeshThatIsInsideOut) {
  EXPECT_THAT(Check(Reversed(Box())),
              ElementsAre(Violation("mesh.triangles", "inside out: it encloses -6 m^3")));
}

TEST(ClosedMeshTest, RefusesAMeshWithoutVolume) {
  const TriangleMesh pillow = {.positions_m = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}},
                               .triangles = {{0, 1, 2}, {0, 2, 3}, {2, 1, 0}, {3, 2, 0}}};
  // Edge 0-2 belongs to four triangles; folded along another diagonal each edge has two.
  EXPECT_THAT(Check(pillow), Contains(Violation("mesh.triangles[0]", "belongs to 4 triangles")));
  TriangleMesh folded = pillow;
  folded.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 0, 3}, {1, 3, 2}};
  EXPECT_THAT(Check(folded), ElementsAre(Violation("mesh.triangles", "which is no volume")));
}

TEST(ClosedMeshTest, RefusesPartsThatTouchInOneVertex) {
  TriangleMesh mesh = Join(TetrahedronMesh(1), Moved(TetrahedronMesh(1), {1, 0, 0}));
  for (auto& triangle : mesh.triangles) {
    for (uint32_t& vertex : triangle) {
      if (vertex == 4) vertex = 1;  // the second one's origin is the first one's (1, 0, 0)
    }
  }
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.positions_m[1]", "share no edge")));
}

TEST(ClosedMeshTest, RefusesTrianglesWithoutArea) {
  TriangleMesh mesh = Box();
  mesh.positions_m.push_back(0.5 * (mesh.positions_m[0] + mesh.positions_m[1]));
  mesh.triangles.push_back({0, 1, 8});
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.triangles[12]", "no area")));
}

TEST(ClosedMeshTest, RefusesSizesAndValuesOutOfRange) {
  TriangleMesh mesh = Box();
  mesh.triangles.resize(3);
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.triangles", "3 triangles;")));
  EXPECT_THAT(Check({}), ElementsAre(Violation("mesh.triangles", "0 triangles;")));

  mesh = Box();
  EXPECT_THAT(CheckClosedMesh(mesh, {.max_vertices = 7, .max_triangles = 11}),
              ElementsAre(Violation("mesh.positions_m", "8 vertices; at most 7"),
                          Violation("mesh.triangles", "12 triangles; a closed mesh has 4 to 11")));

  mesh.positions_m[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.positions_m[3]", "nan, 0) is not in")));

  mesh = Box();
  mesh.triangles[2][1] = 8;
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.triangles[2]", "8 is not in [0, 7]")));

  mesh = BoxMesh(Vector3d::Zero(), Vector3d::Constant(1e-7));
  EXPECT_THAT(Check(mesh), ElementsAre(Violation("mesh.positions_m", "at least")));
}

TEST(ClosedMeshTest, VolumeIsThatOfTheSolid) {
  EXPECT_NEAR(EnclosedVolume(Box()), 6, 1e-14);
  EXPECT_NEAR(EnclosedVolume(Reversed(Box())), -6, 1e-14);
  EXPECT_NEAR(EnclosedVolume(Moved(Box(), {1e3, -1e3, 1e3})), 6, 1e-10);
  EXPECT_NEAR(EnclosedVolume(TetrahedronMesh(0.5)), 0.5 / 6, 1e-15);
  EXPECT_EQ(EnclosedVolume({}), 0);
  // Second order in the edges: each subdivision leaves a quarter of the difference.
  const double ball = 4.0 / 3 * std::numbers::pi;
  const double coarse = ball - EnclosedVolume(SphereMesh(1, 2));
  const double fine = ball - EnclosedVolume(SphereMesh(1, 3));
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(coarse / fine, 4, 0.1);
}

TEST(ClosedMeshTest, TwinsRunTheSameEdgeBackwards) {
  const TriangleMesh mesh = TorusMesh(1, 0.3, 8);
  const std::vector<uint32_t> twins = TwinHalfEdges(mesh);
  ASSERT_THAT(twins, SizeIs(3 * mesh.triangles.size()));
  const auto from = [&](uint32_t h) { return mesh.triangles[h / 3][h % 3]; };
  const auto to = [&](uint32_t h) { return mesh.triangles[h / 3][(h + 1) % 3]; };
  for (uint32_t h = 0; h < twins.size(); ++h) {
    EXPECT_EQ(twins[twins[h]], h);
    EXPECT_EQ(from(twins[h]), to(h));
    EXPECT_EQ(to(twins[h]), from(h));
  }
}

}  // namespace
}  // namespace drape::test
