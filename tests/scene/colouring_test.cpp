#include "server/scene/colouring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "server/scene/constraint_builder.h"

namespace drape {
namespace {

// Bender et al. 2009, Algorithm 1, word by word, with "for all c2 in g": quadratic, the yardstick.
std::vector<uint32_t> LiteralAlgorithm1(const std::vector<DistanceConstraint>& constraints) {
  std::vector<std::vector<DistanceConstraint>> groups;
  std::vector<uint32_t> colours;
  const auto share_a_particle = [](const DistanceConstraint& a, const DistanceConstraint& b) {
    return a.i == b.i || a.i == b.j || a.j == b.i || a.j == b.j;
  };
  for (const DistanceConstraint& c1 : constraints) {
    bool is_inserted = false;
    for (uint32_t g = 0; g < groups.size() && !is_inserted; ++g) {
      bool has_conflict = false;
      for (const DistanceConstraint& c2 : groups[g]) {
        if (share_a_particle(c1, c2)) has_conflict = true;
      }
      if (has_conflict) continue;
      groups[g].push_back(c1);
      colours.push_back(g);
      is_inserted = true;
    }
    if (is_inserted) continue;
    groups.push_back({c1});
    colours.push_back(static_cast<uint32_t>(groups.size()) - 1);
  }
  return colours;
}

struct Graph {
  std::string name;
  uint32_t particle_count = 0;
  std::vector<DistanceConstraint> constraints;
};

Graph GridGraph(uint32_t columns, uint32_t rows) {
  const GridTopology grid{.columns = columns, .rows = rows, .width_m = 1, .height_m = 1};
  return {"grid " + std::to_string(columns) + "x" + std::to_string(rows), columns * rows,
          BuildGrid(grid, {}).distance_constraints};
}

Graph RandomGraph(uint32_t particle_count, uint32_t constraint_count, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<uint32_t> particle(0, particle_count - 1);
  Graph graph{"random " + std::to_string(seed), particle_count, {}};
  while (graph.constraints.size() < constraint_count) {
    const uint32_t i = particle(random);
    const uint32_t j = particle(random);
    if (i != j) graph.constraints.push_back({.i = i, .j = j, .rest_length_m = 1});
  }
  return graph;
}

// More colours than one word of a mask holds, at the hub and at the rim.
Graph WheelGraph(uint32_t spokes) {
  Graph graph{"wheel " + std::to_string(spokes), spokes + 1, {}};
  for (uint32_t k = 0; k < spokes; ++k) {
    graph.constraints.push_back({.i = 0, .j = k + 1, .rest_length_m = 1});
  }
  for (uint32_t k = 0; k < spokes; ++k) {
    graph.constraints.push_back({.i = k + 1, .j = (k + 1) % spokes + 1, .rest_length_m = 1});
  }
  return graph;
}

// A grid of quads split along alternating diagonals.
Graph MeshGraph(uint32_t columns, uint32_t rows) {
  TriangleMesh mesh;
  for (uint32_t k = 0; k < columns * rows; ++k) {
    mesh.positions_m.emplace_back(k % columns, 0, k / columns);
  }
  for (uint32_t row = 0; row + 1 < rows; ++row) {
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t a = row * columns + column;
      const uint32_t b = a + 1;
      const uint32_t c = a + columns;
      const uint32_t d = c + 1;
      if ((row + column) % 2 == 0) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, d}, {a, d, b}});
      }
    }
  }
  return {"mesh", columns * rows, BuildMesh(mesh, {}).distance_constraints};
}

std::vector<Graph> Graphs() {
  std::vector<Graph> graphs = {{"empty", 3, {}}, WheelGraph(3), WheelGraph(150), MeshGraph(9, 14)};
  for (const auto& [columns, rows] : std::vector<std::pair<uint32_t, uint32_t>>{
           {2, 1}, {1, 2}, {3, 1}, {2, 2}, {5, 7}, {31, 33}, {32, 32}}) {
    graphs.push_back(GridGraph(columns, rows));
  }
  for (uint32_t seed = 1; seed <= 8; ++seed) graphs.push_back(RandomGraph(40, 60 * seed, seed));
  return graphs;
}

TEST(Colouring, EqualsTheLiteralAlgorithm) {
  for (const Graph& graph : Graphs()) {
    EXPECT_EQ(ColourConstraints(graph.constraints, graph.particle_count),
              LiteralAlgorithm1(graph.constraints))
        << graph.name;
  }
}

TEST(Colouring, NoTwoConstraintsOfAColourShareAParticle) {
  for (const Graph& graph : Graphs()) {
    const auto colours = ColourConstraints(graph.constraints, graph.particle_count);
    ASSERT_EQ(colours.size(), graph.constraints.size());
    std::vector<std::vector<bool>> is_taken;  // [colour][particle]
    for (size_t k = 0; k < colours.size(); ++k) {
      if (colours[k] >= is_taken.size()) {
        is_taken.resize(colours[k] + 1, std::vector<bool>(graph.particle_count, false));
      }
      for (const uint32_t p : {graph.constraints[k].i, graph.constraints[k].j}) {
        EXPECT_FALSE(is_taken[colours[k]][p]) << graph.name << ", constraint " << k;
        is_taken[colours[k]][p] = true;
      }
    }
  }
}

// When (i, j) is coloured its ends have at most 2 (max_degree - 1) other colours.
TEST(Colouring, UsesAtMostTwiceTheDegreeLessOneColours) {
  for (const Graph& graph : Graphs()) {
    if (graph.constraints.empty()) continue;
    std::vector<uint32_t> degrees(graph.particle_count, 0);
    for (const auto& constraint : graph.constraints) {
      ++degrees[constraint.i];
      ++degrees[constraint.j];
    }
    const auto colours = ColourConstraints(graph.constraints, graph.particle_count);
    const uint32_t colour_count = *std::max_element(colours.begin(), colours.end()) + 1;
    EXPECT_LE(colour_count, 2 * *std::max_element(degrees.begin(), degrees.end()) - 1)
        << graph.name;
  }
}

TEST(Colouring, GridsNeedAtMostFourColours) {
  for (uint32_t columns = 1; columns <= 12; ++columns) {
    for (uint32_t rows = columns == 1 ? 2 : 1; rows <= 12; ++rows) {
      const Graph graph = GridGraph(columns, rows);
      const auto colours = ColourConstraints(graph.constraints, graph.particle_count);
      const uint32_t colour_count = *std::max_element(colours.begin(), colours.end()) + 1;
      EXPECT_LE(colour_count, 4u) << graph.name;
      if (columns >= 3 && rows >= 4) {
        EXPECT_EQ(colour_count, 4u) << graph.name;
      }
    }
  }
}

}  // namespace
}  // namespace drape
