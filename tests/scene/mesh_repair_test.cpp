#include "server/scene/mesh_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <utility>

#include "server/scene/mesh.h"
#include "server/scene/scene_model.h"

namespace drape {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

// Cells of 0.1 m, (columns + 1) * (rows + 1) vertices row by row, both triangles of a cell wound
// the same way.
TriangleMesh Sheet(uint32_t columns, uint32_t rows) {
  TriangleMesh mesh;
  for (uint32_t r = 0; r <= rows; ++r) {
    for (uint32_t c = 0; c <= columns; ++c) mesh.positions_m.emplace_back(0.1 * c, 0, 0.1 * r);
  }
  for (uint32_t r = 0; r < rows; ++r) {
    for (uint32_t c = 0; c < columns; ++c) {
      const uint32_t i = r * (columns + 1) + c, j = i + columns + 1;
      mesh.triangles.push_back({i, j, i + 1});
      mesh.triangles.push_back({i + 1, j, j + 1});
    }
  }
  return mesh;
}

double Area(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    area += TriangleArea(mesh.positions_m[i], mesh.positions_m[j], mesh.positions_m[k]);
  }
  return area;
}

// Edges that two triangles run along in the same direction.
int OpposedEdges(const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> runs;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++runs[{t[k], t[(k + 1) % 3]}];
  }
  return static_cast<int>(
      std::ranges::count_if(runs, [](const auto& run) { return run.second > 1; }));
}

double ShortestEdge(const TriangleMesh& mesh) {
  double shortest = 1e9;
  for (const MeshEdge& edge : UniqueEdges(mesh.triangles)) {
    shortest = std::min(shortest, (mesh.positions_m[edge.i] - mesh.positions_m[edge.j]).norm());
  }
  return shortest;
}

TEST(MeshRepair, AMeshWithoutDefectsKeepsItsBits) {
  const TriangleMesh drawn = Sheet(7, 5);
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts, MeshRepairCounts());
  EXPECT_TRUE(repaired.vertex_of_drawn.empty());
  EXPECT_EQ(repaired.mesh.triangles, drawn.triangles);
  EXPECT_EQ(repaired.mesh.positions_m, drawn.positions_m);
}

// Cells of 1 : 30 have edges far shorter than others, but they are no exceptions.
TEST(MeshRepair, ShortEdgesAllOverAMeshAreItsOwnResolution) {
  TriangleMesh drawn = Sheet(7, 5);
  for (Eigen::Vector3d& p : drawn.positions_m) p.x() /= 30;
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.collapsed_vertices, 0u);
  EXPECT_EQ(repaired.mesh.positions_m, drawn.positions_m);
}

// Each cell has corners of its own, as importers make them that split at normals.
TEST(MeshRepair, SeamsAreWelded) {
  const TriangleMesh whole = Sheet(6, 4);
  TriangleMesh drawn;
  for (const auto& triangle : whole.triangles) {
    for (const uint32_t corner : triangle) {
      drawn.positions_m.push_back(whole.positions_m[corner] +
                                  1e-6 * Eigen::Vector3d(0, corner % 3, 0));
    }
    const auto end = static_cast<uint32_t>(drawn.positions_m.size());
    drawn.triangles.push_back({end - 3, end - 2, end - 1});
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.mesh.positions_m.size(), whole.positions_m.size());
  EXPECT_EQ(UniqueEdges(repaired.mesh.triangles).size(), UniqueEdges(whole.triangles).size());
  EXPECT_EQ(repaired.counts.welded_vertices, drawn.positions_m.size() - whole.positions_m.size());
  ASSERT_EQ(repaired.vertex_of_drawn.size(), drawn.positions_m.size());
  for (size_t v = 0; v < drawn.positions_m.size(); ++v) {
    const Eigen::Vector3d& stays = repaired.mesh.positions_m[repaired.vertex_of_drawn[v]];
    EXPECT_LE((stays - drawn.positions_m[v]).norm(), repaired.counts.largest_shift_m);
  }
  EXPECT_LE(repaired.counts.largest_shift_m, 2e-6);
}

// The inner vertices of two layers are at the same places, but only the rims are sewn.
TEST(MeshRepair, LayersAreSewnAtTheirRimsAlone) {
  const TriangleMesh layer = Sheet(4, 4);
  TriangleMesh drawn = layer;
  const auto count = static_cast<uint32_t>(layer.positions_m.size());
  drawn.positions_m.insert(drawn.positions_m.end(), layer.positions_m.begin(),
                           layer.positions_m.end());
  // Mirrored, so that no triangle at a corner is in both layers.
  const auto below = [&](uint32_t v) { return v / 5 * 5 + 4 - v % 5 + count; };
  for (const auto& [i, j, k] : layer.triangles) {
    drawn.triangles.push_back({below(i), below(j), below(k)});
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.welded_vertices, 16u);
  EXPECT_EQ(repaired.mesh.positions_m.size(), 2 * count - 16);
  EXPECT_EQ(repaired.mesh.triangles.size(), drawn.triangles.size());
  EXPECT_EQ(OpposedEdges(repaired.mesh), 0);
}

// Vertices put into a sheet at a hundredth of an edge from others.
TEST(MeshRepair, EdgesFarShorterThanTheOthersCollapse) {
  const TriangleMesh whole = Sheet(12, 12);
  TriangleMesh drawn = whole;
  std::mt19937 random(7);
  for (const uint32_t t : {20u, 77u, 130u, 201u}) {
    const auto [i, j, k] = drawn.triangles[t];
    const auto added = static_cast<uint32_t>(drawn.positions_m.size());
    const Eigen::Vector3d middle =
        (drawn.positions_m[i] + drawn.positions_m[j] + drawn.positions_m[k]) / 3;
    drawn.positions_m.push_back(drawn.positions_m[i] + 0.01 * (middle - drawn.positions_m[i]));
    drawn.triangles[t] = {i, j, added};
    drawn.triangles.push_back({j, k, added});
    drawn.triangles.push_back({k, i, added});
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.collapsed_vertices, 4u);
  EXPECT_EQ(repaired.mesh.positions_m.size(), whole.positions_m.size());
  EXPECT_EQ(repaired.mesh.triangles.size(), whole.triangles.size());
  EXPECT_GT(ShortestEdge(repaired.mesh), 0.09);
  // Half of the distance at most: the two that become one meet in the middle.
  EXPECT_LE(repaired.counts.largest_shift_m, 0.01 * 0.1 * std::sqrt(2.0) / 2);
  EXPECT_NEAR(Area(repaired.mesh), Area(whole), 1e-3 * Area(whole));
}

// A line of vertices, each far nearer to the next than an edge is long, does not shrink to a point.
TEST(MeshRepair, ALineOfShortEdgesKeepsItsLength) {
  TriangleMesh drawn = Sheet(20, 20);
  const uint32_t i = 0, j = 21;  // the edge x = 0, z in [0, 0.1], in the triangle 0
  const uint32_t apex = drawn.triangles[0][2];
  constexpr uint32_t kPieces = 100;
  uint32_t before = i;
  drawn.triangles.erase(drawn.triangles.begin());
  for (uint32_t k = 1; k <= kPieces; ++k) {
    uint32_t next = j;
    if (k < kPieces) {
      next = static_cast<uint32_t>(drawn.positions_m.size());
      drawn.positions_m.emplace_back(0, 0, 0.1 * k / kPieces);
    }
    drawn.triangles.push_back({before, next, apex});
    before = next;
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  const double limit_m = kCollapseShare * LeastTypicalEdge_m(drawn);
  EXPECT_GE(ShortestEdge(repaired.mesh), limit_m);
  EXPECT_LT(repaired.counts.largest_shift_m, 2 * limit_m);
  EXPECT_NEAR(Area(repaired.mesh), Area(drawn), 2 * limit_m * 0.1);
}

// Short edges that all share a vertex, while those between their other ends are long: a round can
// remove one of them, and would pass over the whole mesh for each.
TEST(MeshRepair, ThousandsOfShortEdgesAtOneVertexEndAfterSomeRounds) {
  TriangleMesh drawn = Sheet(60, 60);
  const double limit_m = kCollapseShare * 0.1;
  const auto hub = static_cast<uint32_t>(drawn.positions_m.size());
  const Eigen::Vector3d middle(-1, 0, 0);
  drawn.positions_m.push_back(middle);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift_m(-0.15 * limit_m, 0.15 * limit_m);
  constexpr uint32_t kTriangles = 300;
  for (uint32_t t = 0; t < kTriangles; ++t) {
    for (const double side : {-0.75, 0.75}) {
      drawn.positions_m.emplace_back(middle.x() + side * limit_m + shift_m(random), shift_m(random),
                                     shift_m(random));
    }
    drawn.triangles.push_back({hub, hub + 1 + 2 * t, hub + 2 + 2 * t});
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_GT(repaired.counts.collapsed_vertices, 10u);
  EXPECT_LT(repaired.counts.collapsed_vertices, 100u);
}

// A vertex just beside the middle of an edge, towards one side: the edge spans it.
TEST(MeshRepair, TheLongEdgeOfACapIsFlipped) {
  TriangleMesh drawn;
  drawn.positions_m = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0.9}, {0.5, 0, -0.9}, {0.5, 0, 0.004}};
  drawn.triangles = {{0, 4, 2}, {4, 1, 2}, {0, 1, 4}, {1, 0, 3}};
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.flipped_edges, 1u);
  EXPECT_EQ(OpposedEdges(repaired.mesh), 0);
  EXPECT_EQ(repaired.mesh.triangles.size(), 4u);
  EXPECT_NEAR(Area(repaired.mesh), Area(drawn), 1e-15);
  for (const MeshEdge& edge : UniqueEdges(repaired.mesh.triangles)) {
    EXPECT_FALSE(edge.i == 0 && edge.j == 1);
  }
}

TEST(MeshRepair, ACapAtTheBorderGoes) {
  TriangleMesh drawn;
  drawn.positions_m = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0.9}, {0.5, 0, 0.004}};
  drawn.triangles = {{0, 3, 2}, {3, 1, 2}, {0, 1, 3}};
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.dropped_triangles, 1u);
  EXPECT_EQ(repaired.mesh.triangles, (Triangles{{0, 3, 2}, {3, 1, 2}}));
}

TEST(MeshRepair, TrianglesDrawnTwiceAndThoseWithoutAreaGo) {
  TriangleMesh drawn = Sheet(3, 3);
  const size_t count = drawn.triangles.size();
  const auto [i, j, k] = drawn.triangles[4];
  drawn.triangles.push_back({j, i, k});
  drawn.triangles.push_back({i, i, k});
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.dropped_triangles, 2u);
  EXPECT_EQ(repaired.mesh.triangles.size(), count);
  EXPECT_EQ(OpposedEdges(repaired.mesh), 0);
}

// Three vertices that no triangle ever had, and one whose only triangle has no area.
TEST(MeshRepair, VerticesOfNoTriangleStayAndAreCounted) {
  TriangleMesh drawn = Sheet(3, 3);
  const auto first = static_cast<uint32_t>(drawn.positions_m.size());
  for (const double x : {2, 3, 4, 5}) drawn.positions_m.emplace_back(x, 1, 0);
  drawn.triangles.push_back({0, first, first});
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts, (MeshRepairCounts{.dropped_triangles = 1, .loose_vertices = 4}));
  EXPECT_EQ(repaired.mesh.positions_m, drawn.positions_m);
}

// Most are wound one way in each of two sheets, against each other.
TEST(MeshRepair, WindingIsThatOfTheMostPartByPart) {
  TriangleMesh drawn = Sheet(6, 5);
  const TriangleMesh second = Sheet(4, 4);
  const auto first_count = static_cast<uint32_t>(drawn.triangles.size());
  const auto offset = static_cast<uint32_t>(drawn.positions_m.size());
  for (const Eigen::Vector3d& p : second.positions_m) {
    drawn.positions_m.push_back(p + Eigen::Vector3d(3, 0, 0));
  }
  for (const auto& [i, j, k] : second.triangles) {
    drawn.triangles.push_back({i + offset, k + offset, j + offset});
  }
  const Triangles right = drawn.triangles;
  for (const uint32_t t : {0u, 9u, 10u, 31u, first_count + 3, first_count + 8}) {
    std::swap(drawn.triangles[t][1], drawn.triangles[t][2]);
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.counts.turned_triangles, 6u);
  EXPECT_EQ(repaired.mesh.triangles, right);
}

TEST(MeshRepair, AMoebiusStripStaysWhatItIs) {
  TriangleMesh drawn;
  constexpr uint32_t kCells = 12;
  for (uint32_t k = 0; k < kCells; ++k) {
    const double turn = 2 * M_PI * k / kCells;
    const Eigen::Vector3d middle(std::cos(turn), 0, std::sin(turn));
    const Eigen::Vector3d across =
        0.2 * (std::cos(turn / 2) * middle + std::sin(turn / 2) * Eigen::Vector3d::UnitY());
    drawn.positions_m.push_back(middle - across);
    drawn.positions_m.push_back(middle + across);
  }
  for (uint32_t k = 0; k < kCells; ++k) {
    const uint32_t a = 2 * k, b = a + 1;
    const bool is_last = k + 1 == kCells;
    const uint32_t c = is_last ? 1 : a + 2, d = is_last ? 0 : a + 3;
    drawn.triangles.push_back({a, b, c});
    drawn.triangles.push_back({b, d, c});
  }
  const RepairedMesh repaired = RepairMesh(drawn);
  EXPECT_EQ(repaired.mesh.triangles.size(), drawn.triangles.size());
  EXPECT_EQ(OpposedEdges(repaired.mesh), 1);
}

TEST(MeshRepair, WhereMoreThanTwoTrianglesMeetTheStraightestAreOneSheet) {
  // A flap, drawn second, hangs from the edge between the two others.
  TriangleMesh mesh;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 1}, {0.5, -1, 0.2}, {0.5, 0, -1}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 1}, {0, 1, 4}};
  EXPECT_EQ(RepairMesh(mesh).counts.non_manifold_edges, 1u);
  const std::vector<MeshEdge> edges = UniqueEdges(mesh.triangles);
  const auto shared =
      std::ranges::find_if(edges, [](const MeshEdge& e) { return e.i == 0 && e.j == 1; });
  EXPECT_EQ(SheetsAcross(*shared, mesh.positions_m),
            (std::vector<std::array<uint32_t, 2>>{{2, 4}}));
}

// Clients count vertices as drawn, whatever became of them.
TEST(MeshRepair, AModelKnowsTheParticleOfEveryVertex) {
  TriangleMesh drawn = Sheet(4, 4);
  const auto [i, j, k] = drawn.triangles[7];
  drawn.positions_m.push_back(drawn.positions_m[i] + Eigen::Vector3d(1e-4, 0, 1e-4));
  const auto added = static_cast<uint32_t>(drawn.positions_m.size() - 1);
  drawn.triangles[7] = {i, j, added};
  drawn.triangles.push_back({j, k, added});
  drawn.triangles.push_back({k, i, added});
  ModelDescription description{
      .topology = drawn, .material = {}, .pinned_particles = {added, 3, i}};
  const auto model = SceneModel::Build(description);
  ASSERT_TRUE(model.ok()) << model.status().ToString();
  const SceneModel& merged = **model;
  EXPECT_EQ(merged.described_particle_count(), drawn.positions_m.size());
  EXPECT_EQ(merged.particle_count(), drawn.positions_m.size() - 1);
  EXPECT_EQ(merged.ParticleOf(added), i);
  for (uint32_t particle = 0; particle < merged.particle_count(); ++particle) {
    uint32_t first = 0;
    while (merged.ParticleOf(first) != particle) ++first;
    EXPECT_EQ(merged.DescribedOf(particle), first);
  }
  EXPECT_EQ(merged.pin_count(), 2u);
  EXPECT_EQ(merged.mesh_repair().collapsed_vertices, 1u);

  description.mesh_import.as_drawn = true;
  const auto as_drawn = SceneModel::Build(description);
  ASSERT_TRUE(as_drawn.ok()) << as_drawn.status().ToString();
  EXPECT_EQ((*as_drawn)->particle_count(), drawn.positions_m.size());
  EXPECT_EQ((*as_drawn)->pin_count(), 3u);
  EXPECT_EQ((*as_drawn)->mesh_repair(), MeshRepairCounts());
  EXPECT_FALSE((*as_drawn)->SameContent(merged));
}

}  // namespace
}  // namespace drape
