#include "server/scene/constraint_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace drape {
namespace {

double TotalMass(const ParticleSystem& system) {
  return std::accumulate(system.masses_kg.begin(), system.masses_kg.end(), 0.0);
}

constexpr StructuralMaterial kStiffMaterial{.areal_density_kg_per_m2 = 0.3,
                                            .stretch_compliance_m_per_n = 1e-4,
                                            .bending_stiffness_n_per_m = 2,
                                            .shear_stiffness_n_per_m = 3};

class GridSizes : public ::testing::TestWithParam<std::pair<uint32_t, uint32_t>> {};

TEST_P(GridSizes, CountsPositionsAndMass) {
  const auto [columns, rows] = GetParam();
  const GridTopology grid{.columns = columns, .rows = rows, .width_m = 1.5, .height_m = 0.7};
  const ParticleSystem system = BuildGrid(grid, kStiffMaterial);
  const size_t c = columns;
  const size_t r = rows;
  const auto less = [](size_t n, size_t k) { return n > k ? n - k : 0; };
  ASSERT_EQ(system.rest_positions_m.size(), c * r);
  ASSERT_EQ(system.masses_kg.size(), c * r);
  EXPECT_EQ(system.distance_constraints.size(), (c - 1) * r + c * (r - 1));
  EXPECT_EQ(system.springs.size(), less(c, 2) * r + c * less(r, 2) + 2 * (c - 1) * (r - 1));
  EXPECT_EQ(system.triangles.size(), 2 * (c - 1) * (r - 1));

  // Each of the c r equal masses is rounded once, the sum c r times: c r ulp are plenty.
  const double mass = 0.3 * 1.5 * 0.7;
  EXPECT_NEAR(TotalMass(system), mass, 2.3e-16 * static_cast<double>(c * r) * mass);
  for (size_t row = 0; row < r; ++row) {
    for (size_t column = 0; column < c; ++column) {
      const double x = c > 1 ? static_cast<double>(column) * 1.5 / static_cast<double>(c - 1) : 0;
      const double z = r > 1 ? static_cast<double>(row) * 0.7 / static_cast<double>(r - 1) : 0;
      EXPECT_EQ(system.rest_positions_m[row * c + column], Eigen::Vector3d(x, 0, z));
    }
  }
}

TEST_P(GridSizes, EveryPairIsAtItsRestLength) {
  const auto [columns, rows] = GetParam();
  const GridTopology grid{.columns = columns, .rows = rows, .width_m = 1.5, .height_m = 0.7};
  const ParticleSystem system = BuildGrid(grid, kStiffMaterial);
  // Positions are rounded to half an ulp of at most 1.5 m; a difference of two and its norm to
  // about twice that.
  constexpr double kRounding_m = 4 * 2.3e-16 * 1.5;
  for (const auto& c : system.distance_constraints) {
    const double length = (system.rest_positions_m[c.i] - system.rest_positions_m[c.j]).norm();
    EXPECT_NEAR(c.rest_length_m, length, kRounding_m);
    EXPECT_EQ(c.compliance_m_per_n, 1e-4);
  }
  for (const auto& s : system.springs) {
    const double length = (system.rest_positions_m[s.i] - system.rest_positions_m[s.j]).norm();
    EXPECT_NEAR(s.rest_length_m, length, kRounding_m);
  }
}

INSTANTIATE_TEST_SUITE_P(Awkward, GridSizes,
                         ::testing::Values(std::pair{1u, 2u}, std::pair{2u, 1u}, std::pair{3u, 1u},
                                           std::pair{1u, 5u}, std::pair{2u, 2u}, std::pair{2u, 3u},
                                           std::pair{31u, 33u}, std::pair{32u, 32u}));

TEST(BuildGrid, EdgesRunAlongRowsThenAlongColumns) {
  const ParticleSystem system =
      BuildGrid({.columns = 3, .rows = 2, .width_m = 2, .height_m = 1}, kStiffMaterial);
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (const auto& c : system.distance_constraints) edges.emplace_back(c.i, c.j);
  const std::vector<std::pair<uint32_t, uint32_t>> expected = {{0, 1}, {1, 2}, {3, 4}, {4, 5},
                                                               {0, 3}, {1, 4}, {2, 5}};
  EXPECT_EQ(edges, expected);
  std::vector<std::pair<uint32_t, uint32_t>> springs;
  for (const auto& s : system.springs) springs.emplace_back(s.i, s.j);
  const std::vector<std::pair<uint32_t, uint32_t>> expected_springs = {{0, 2}, {3, 5}, {0, 4},
                                                                       {1, 5}, {1, 3}, {2, 4}};
  EXPECT_EQ(springs, expected_springs);
  EXPECT_EQ(system.springs[0].stiffness_n_per_m, 2) << "bending";
  EXPECT_EQ(system.springs[2].stiffness_n_per_m, 3) << "shear";
}

TEST(BuildGrid, SpringsOfStiffnessZeroAreNotMade) {
  EXPECT_TRUE(
      BuildGrid({.columns = 5, .rows = 5, .width_m = 1, .height_m = 1}, {}).springs.empty());
}

TEST(BuildGrid, TrianglesAreCounterClockwiseSeenFromAboveAndCoverTheRectangle) {
  const ParticleSystem system =
      BuildGrid({.columns = 4, .rows = 3, .width_m = 3, .height_m = 2}, {});
  double area = 0;
  for (const auto& [i, j, k] : system.triangles) {
    const auto& p = system.rest_positions_m;
    const Eigen::Vector3d cross = (p[j] - p[i]).cross(p[k] - p[i]);
    EXPECT_GT(cross.y(), 0);
    area += cross.y() / 2;
  }
  EXPECT_DOUBLE_EQ(area, 6);
}

// Unit square of two triangles and, apart from it, a vertex that no triangle uses.
TriangleMesh SquareMesh() {
  TriangleMesh mesh;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}, {5, 5, 5}};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  return mesh;
}

TEST(BuildMesh, InnerEdgesGetOneConstraintAndOneBendingSpring) {
  const ParticleSystem system = BuildMesh(SquareMesh(), kStiffMaterial);
  EXPECT_EQ(system.distance_constraints.size(), 5u) << "the seam of the quad occurs once";
  ASSERT_EQ(system.springs.size(), 1u);
  EXPECT_EQ(system.springs[0].i, 0u);
  EXPECT_EQ(system.springs[0].j, 3u);
  EXPECT_DOUBLE_EQ(system.springs[0].rest_length_m, std::sqrt(2.0));
  EXPECT_EQ(system.springs[0].stiffness_n_per_m, 2);
  for (const auto& c : system.distance_constraints) EXPECT_EQ(c.compliance_m_per_n, 1e-4);
}

TEST(BuildMesh, ThirdOfEachTrianglePerCornerAndTheMeanForUnusedVertices) {
  const ParticleSystem system = BuildMesh(SquareMesh(), kStiffMaterial);
  const double third = 0.3 * 0.5 / 3;
  const std::vector<double> expected = {third, 2 * third, 2 * third, third, 0.3 / 4};
  ASSERT_EQ(system.masses_kg.size(), expected.size());
  for (size_t k = 0; k < expected.size(); ++k) {
    EXPECT_DOUBLE_EQ(system.masses_kg[k], expected[k]) << k;
  }
}

TEST(BuildMesh, DegenerateTrianglesAreDroppedAndCounted) {
  TriangleMesh mesh = SquareMesh();
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  mesh.positions_m.push_back({2, 0, 0});
  mesh.triangles.push_back({0, 1, 5});  // in a line
  const ParticleSystem system = BuildMesh(mesh, kStiffMaterial);
  EXPECT_EQ(system.dropped_triangles, 3u);
  EXPECT_EQ(system.triangles.size(), 2u);
  EXPECT_EQ(system.distance_constraints.size(), 5u);
}

TEST(BuildMesh, AnEdgeOfThreeTrianglesGetsOneSpringAcrossTheTwoThatGoOnStraight) {
  TriangleMesh mesh;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 4}, {1, 0, 3}};
  const ParticleSystem system = BuildMesh(mesh, kStiffMaterial);
  EXPECT_EQ(system.distance_constraints.size(), 7u);
  ASSERT_EQ(system.springs.size(), 1u);
  EXPECT_EQ(system.springs[0].i, 2u);
  EXPECT_EQ(system.springs[0].j, 3u);
}

TEST(BuildMesh, TheSameTriangleTwiceGivesNoSpringOfAVertexToItself) {
  TriangleMesh mesh = SquareMesh();
  mesh.triangles = {{0, 2, 1}, {0, 2, 1}};
  const ParticleSystem system = BuildMesh(mesh, kStiffMaterial);
  EXPECT_TRUE(system.springs.empty());
  EXPECT_EQ(system.distance_constraints.size(), 3u);
}

// A closed irregular mesh: Euler's formula V - E + F = 2 gives the edges, all of them inner.
TEST(BuildMesh, ClosedIrregularMeshObeysEulersFormula) {
  TriangleMesh mesh;
  mesh.positions_m = {{0, 1.3, 0}, {0, -0.9, 0}};
  constexpr uint32_t kSides = 7;
  for (uint32_t k = 0; k < kSides; ++k) {
    const double angle = 2 * M_PI * (k + 0.3 * (k % 3)) / kSides;
    mesh.positions_m.emplace_back(std::cos(angle), 0.1 * k, std::sin(angle));
  }
  for (uint32_t k = 0; k < kSides; ++k) {
    const uint32_t a = 2 + k;
    const uint32_t b = 2 + (k + 1) % kSides;
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({1, a, b});
  }
  const ParticleSystem system = BuildMesh(mesh, kStiffMaterial);
  EXPECT_EQ(system.distance_constraints.size(), mesh.positions_m.size() + 2 * kSides - 2);
  EXPECT_EQ(system.springs.size(), system.distance_constraints.size());
  double area = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const auto& p = mesh.positions_m;
    area += (p[j] - p[i]).cross(p[k] - p[i]).norm() / 2;
  }
  // Sums of 14 terms in different order.
  EXPECT_NEAR(TotalMass(system), 0.3 * area, 14 * 2.3e-16 * 0.3 * area);
}

TEST(BuildParticles, PassesEverythingOn) {
  ParticleTopology topology;
  topology.positions_m = {{0, 0, 0}, {1, 0, 0}};
  topology.masses_kg = {1, 2};
  topology.distance_constraints = {{.i = 0, .j = 1, .rest_length_m = 1}};
  topology.springs = {{.i = 1, .j = 0, .rest_length_m = 2, .stiffness_n_per_m = 3}};
  const ParticleSystem system = BuildParticleSystem(topology, {});
  EXPECT_EQ(system.rest_positions_m, topology.positions_m);
  EXPECT_EQ(system.masses_kg, topology.masses_kg);
  EXPECT_EQ(system.distance_constraints.size(), 1u);
  EXPECT_EQ(system.springs[0].stiffness_n_per_m, 3);
  EXPECT_TRUE(system.triangles.empty());
}

}  // namespace
}  // namespace drape
