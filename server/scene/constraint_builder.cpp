#include "server/scene/constraint_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/scene/hinge_fit.h"
#include "server/scene/woven_edges.h"

namespace drape {

namespace {

// Adds one kind of constraint or spring to every pair (r, c) - (r + row_step, c + column_step) of a
// grid.
template <class Add>
void ForEachGridPair(const GridTopology& grid, int row_step, int column_step, Add add) {
  const int64_t rows = grid.rows;
  const int64_t columns = grid.columns;
  for (int64_t row = 0; row + row_step < rows; ++row) {
    for (int64_t column = std::max(0, -column_step); column < columns - std::max(0, column_step);
         ++column) {
      const int64_t i = row * columns + column;
      const int64_t j = i + row_step * columns + column_step;
      add(static_cast<uint32_t>(i), static_cast<uint32_t>(j));
    }
  }
}

double GridSpacing(double extent, uint32_t count) {
  return count > 1 ? extent / (count - 1) : 0;
}

// Lengths of a grid: the spacings, and the width of cloth that a row or column represents.
struct GridLengths {
  explicit GridLengths(const GridTopology& grid)
      : dx(GridSpacing(grid.width_m, grid.columns)),
        dz(GridSpacing(grid.height_m, grid.rows)),
        row_width(grid.height_m / grid.rows),
        column_width(grid.width_m / grid.columns) {}

  double dx, dz;  // [m]
  double row_width, column_width;
};

// Compliance of an edge of this length that represents a strip of this width.
double EdgeCompliance(const StructuralMaterial& material, double length, double width) {
  if (material.stretch_stiffness_n_per_m == 0) return material.stretch_compliance_m_per_n;
  return length / (material.stretch_stiffness_n_per_m * width);
}

void AddGridBending(const GridTopology& grid, const GridLengths& lengths, double rigidity,
                    ParticleSystem& system) {
  std::vector<ElasticElement>& elements = system.elastic_elements;
  ForEachGridPair(grid, 0, 2, [&](uint32_t i, uint32_t j) {
    elements.push_back(BendingRod(i, i + 1, j, lengths.dx, lengths.row_width, rigidity));
  });
  ForEachGridPair(grid, 2, 0, [&](uint32_t i, uint32_t j) {
    elements.push_back(
        BendingRod(i, i + grid.columns, j, lengths.dz, lengths.column_width, rigidity));
  });
  const double area = lengths.dx * lengths.dz;
  ForEachGridPair(grid, 1, 1, [&](uint32_t i, uint32_t j) {
    elements.push_back(TwistCell(i, i + 1, i + grid.columns, j, area, rigidity));
  });
}

// A diagonal of a cell sheared by a small angle stretches by angle * dx dz / diagonal. Each cell
// has one, in turn falling and rising. With both it would resist twist, too: a twisted cell whose
// sides keep their lengths has shorter diagonals.
void AddGridShear(const GridTopology& grid, const GridLengths& lengths, double modulus,
                  ParticleSystem& system) {
  const double diagonal = std::hypot(lengths.dx, lengths.dz);
  const double stiffness = modulus * diagonal * diagonal / (lengths.dx * lengths.dz);
  const auto add = [&](uint32_t i, uint32_t j) {
    if ((i / grid.columns + i % grid.columns) % 2 == 1) return;
    system.elastic_elements.push_back(ShearDiagonal(i, j, diagonal, stiffness));
  };
  ForEachGridPair(grid, 1, 1, add);
  ForEachGridPair(grid, 1, -1, add);
}

void AddGridTriangles(const GridTopology& grid, ParticleSystem& system) {
  if (grid.columns < 2 || grid.rows < 2) return;
  system.triangles.reserve(size_t{2} * (grid.columns - 1) * (grid.rows - 1));
  for (uint32_t row = 0; row + 1 < grid.rows; ++row) {
    for (uint32_t column = 0; column + 1 < grid.columns; ++column) {
      const uint32_t corner = row * grid.columns + column;
      // Counter-clockwise seen from +y.
      system.triangles.push_back({corner, corner + grid.columns, corner + 1});
      system.triangles.push_back({corner + 1, corner + grid.columns, corner + grid.columns + 1});
    }
  }
}

// One spring between the vertices opposite the edge for every sheet across it: one for an ordinary
// inner edge.
void AddBendingSprings(const MeshEdge& edge, double stiffness, ParticleSystem& system) {
  for (const auto& [i, j] : SheetsAcross(edge, system.rest_positions_m)) {
    const double length = (system.rest_positions_m[i] - system.rest_positions_m[j]).norm();
    system.springs.push_back(
        {.i = i, .j = j, .rest_length_m = length, .stiffness_n_per_m = stiffness});
  }
}

// Hinges between the same pairs of triangles.
void AddHinges(const MeshEdge& edge, double rigidity, ParticleSystem& system) {
  for (const auto& [k, l] : SheetsAcross(edge, system.rest_positions_m)) {
    system.elastic_elements.push_back(
        Hinge({edge.i, edge.j, k, l}, system.rest_positions_m, rigidity));
  }
}

// Summed area of the triangles at an edge [m^2].
double AreaAround(const MeshEdge& edge, const std::vector<Eigen::Vector3d>& positions_m) {
  double area = 0;
  for (const uint32_t k : edge.opposite_vertices) {
    area += TriangleArea(positions_m[edge.i], positions_m[edge.j], positions_m[k]);
  }
  return area;
}

// Compliance of an edge of a mesh: of woven cloth between that along a thread and that halfway
// between warp and weft (server/solver/method.md, "apply_elastic").
double MeshEdgeCompliance(const StructuralMaterial& material, const MeshEdge& edge, double length,
                          const std::vector<Eigen::Vector3d>& positions_m,
                          const Eigen::Vector3d& warp_direction) {
  const double width = AreaAround(edge, positions_m) / length;
  const double threads = EdgeCompliance(material, length, width);
  if (material.shear_modulus_n_per_m == 0) return threads;
  const double bias = BiasOf(edge, positions_m, warp_direction);
  return (1 - 4 * bias) * threads + bias * length / (material.shear_modulus_n_per_m * width);
}

// A third of the mass of each triangle per corner; the mean of those for vertices without triangle.
std::vector<double> VertexMasses(const TriangleMesh& mesh,
                                 const std::vector<std::array<uint32_t, 3>>& triangles,
                                 double areal_density) {
  std::vector<double> masses(mesh.positions_m.size(), 0.0);
  double total = 0;
  for (const auto& [i, j, k] : triangles) {
    const double mass =
        areal_density * TriangleArea(mesh.positions_m[i], mesh.positions_m[j], mesh.positions_m[k]);
    total += mass;
    for (const uint32_t corner : {i, j, k}) masses[corner] += mass / 3;
  }
  size_t used_vertices = 0;
  for (const double mass : masses) used_vertices += mass > 0;
  for (double& mass : masses) {
    if (mass == 0 && used_vertices > 0) mass = total / static_cast<double>(used_vertices);
  }
  return masses;
}

}  // namespace

ParticleSystem BuildGrid(const GridTopology& grid, const StructuralMaterial& material) {
  ParticleSystem system;
  const size_t particle_count = size_t{grid.columns} * grid.rows;
  const GridLengths lengths(grid);
  const double dx = lengths.dx, dz = lengths.dz;
  const double mass = material.areal_density_kg_per_m2 * grid.width_m * grid.height_m /
                      static_cast<double>(particle_count);
  system.masses_kg.assign(particle_count, mass);
  system.rest_positions_m.reserve(particle_count);
  for (uint32_t row = 0; row < grid.rows; ++row) {
    for (uint32_t column = 0; column < grid.columns; ++column) {
      const double x = grid.columns > 1 ? column * grid.width_m / (grid.columns - 1) : 0;
      const double z = grid.rows > 1 ? row * grid.height_m / (grid.rows - 1) : 0;
      system.rest_positions_m.emplace_back(x, 0, z);
    }
  }

  const auto add_edges = [&](int row_step, int column_step, double length, double width) {
    const double compliance = EdgeCompliance(material, length, width);
    ForEachGridPair(grid, row_step, column_step, [&](uint32_t i, uint32_t j) {
      system.distance_constraints.push_back(
          {.i = i, .j = j, .rest_length_m = length, .compliance_m_per_n = compliance});
    });
  };
  const auto add_springs = [&](int row_step, int column_step, double length, double stiffness) {
    if (stiffness == 0) return;
    ForEachGridPair(grid, row_step, column_step, [&](uint32_t i, uint32_t j) {
      system.springs.push_back(
          {.i = i, .j = j, .rest_length_m = length, .stiffness_n_per_m = stiffness});
    });
  };
  system.distance_constraints.reserve(2 * particle_count);
  add_edges(0, 1, dx, lengths.row_width);
  add_edges(1, 0, dz, lengths.column_width);
  add_springs(0, 2, 2 * dx, material.bending_stiffness_n_per_m);
  add_springs(2, 0, 2 * dz, material.bending_stiffness_n_per_m);
  add_springs(1, 1, std::hypot(dx, dz), material.shear_stiffness_n_per_m);
  add_springs(1, -1, std::hypot(dx, dz), material.shear_stiffness_n_per_m);
  if (material.bending_rigidity_n_m > 0) {
    AddGridBending(grid, lengths, material.bending_rigidity_n_m, system);
  }
  if (material.shear_modulus_n_per_m > 0) {
    AddGridShear(grid, lengths, material.shear_modulus_n_per_m, system);
  }
  AddGridTriangles(grid, system);
  return system;
}

ParticleSystem BuildMesh(const TriangleMesh& drawn, const StructuralMaterial& material,
                         const MeshImport& import, Interruption* interruption) {
  RepairedMesh repaired;
  if (!import.as_drawn) repaired = RepairMesh(drawn, interruption);
  const TriangleMesh& mesh = import.as_drawn ? drawn : repaired.mesh;
  ParticleSystem system;
  system.particle_of_vertex = std::move(repaired.vertex_of_drawn);
  system.mesh_repair = repaired.counts;
  system.rest_positions_m = mesh.positions_m;
  system.triangles.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    if (!IsDegenerate(mesh, triangle)) system.triangles.push_back(triangle);
  }
  system.dropped_triangles =
      static_cast<uint32_t>(drawn.triangles.size() - system.triangles.size());
  system.masses_kg = VertexMasses(mesh, system.triangles, material.areal_density_kg_per_m2);
  Ask(interruption);
  const std::vector<MeshEdge> edges = UniqueEdges(system.triangles);
  Ask(interruption);
  const auto crowded = std::ranges::find_if(edges, [](const MeshEdge& edge) {
    return edge.opposite_vertices.size() > kMaxTrianglesAtEdge;
  });
  if (crowded != edges.end()) {
    system.crowded_edge = *crowded;
    return system;
  }
  for (const MeshEdge& edge : edges) {
    const double length = (mesh.positions_m[edge.i] - mesh.positions_m[edge.j]).norm();
    system.distance_constraints.push_back(
        {.i = edge.i,
         .j = edge.j,
         .rest_length_m = length,
         .compliance_m_per_n =
             MeshEdgeCompliance(material, edge, length, mesh.positions_m, import.warp_direction)});
    if (material.bending_rigidity_n_m > 0) AddHinges(edge, material.bending_rigidity_n_m, system);
    if (material.bending_stiffness_n_per_m > 0) {
      AddBendingSprings(edge, material.bending_stiffness_n_per_m, system);
    }
  }
  FitHingesToPlate(system.rest_positions_m, material.bending_rigidity_n_m, system.elastic_elements,
                   interruption);
  return system;
}

double RestDistance_m(uint32_t i, uint32_t j, const std::vector<Eigen::Vector3d>& positions_m) {
  if (i >= positions_m.size() || j >= positions_m.size()) return 1;
  const double length_m = (positions_m[i] - positions_m[j]).norm();
  return length_m > 0 ? length_m : 1;
}

ParticleSystem BuildParticles(const ParticleTopology& particles) {
  ParticleSystem system;
  system.rest_positions_m = particles.positions_m;
  system.masses_kg = particles.masses_kg;
  system.distance_constraints = particles.distance_constraints;
  system.springs = particles.springs;
  system.point_joints = particles.point_joints;
  return system;
}

ParticleSystem BuildParticleSystem(const Topology& topology, const StructuralMaterial& material,
                                   const MeshImport& mesh_import, Interruption* interruption) {
  if (const auto* grid = std::get_if<GridTopology>(&topology)) return BuildGrid(*grid, material);
  if (const auto* mesh = std::get_if<TriangleMesh>(&topology))
    return BuildMesh(*mesh, material, mesh_import, interruption);
  return BuildParticles(std::get<ParticleTopology>(topology));
}

}  // namespace drape
