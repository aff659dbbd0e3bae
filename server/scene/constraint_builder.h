// From a topology to particles, distance constraints, springs and joints. Pure; input already
// validated.
#pragma once

#include "server/core/interruption.h"
#include "server/scene/description.h"
#include "server/scene/elastic_elements.h"
#include "server/scene/mesh.h"
#include "server/scene/mesh_repair.h"

namespace drape {

// A particle system in its rest frame, before pins and colours.
struct ParticleSystem {
  std::vector<Eigen::Vector3d> rest_positions_m;  // [particle_count]
  std::vector<double> masses_kg;                  // [particle_count]
  std::vector<DistanceConstraint> distance_constraints;
  std::vector<Spring> springs;
  std::vector<PointJoint> point_joints;
  std::vector<ElasticElement> elastic_elements;
  std::vector<std::array<uint32_t, 3>> triangles;  // for drawing and export; may be empty
  uint32_t dropped_triangles = 0;                  // left out: without area, or by the repair
  // Of a mesh: the particle of each vertex as drawn, empty where that is its own number, and what
  // was repaired.
  std::vector<uint32_t> particle_of_vertex{};
  MeshRepairCounts mesh_repair{};
  // Of a mesh with an edge of more than kMaxTrianglesAtEdge triangles: such an edge. Nothing is
  // built then but particles and triangles.
  std::optional<MeshEdge> crowded_edge{};
};

// Structural edges along rows, then along columns; bending springs between particles at a distance
// of two; shear springs along both diagonals of each cell. Springs of stiffness 0 are not made.
// Elastic elements: a rod for every three particles in a row or column, a twist for every cell,
// then the diagonals of every cell that shear. Every row represents an equal part of the height,
// like its weight, and every column an equal part of the width: the stretch stiffness and the
// bending rigidity of a strip are exactly those of its material at any resolution.
ParticleSystem BuildGrid(const GridTopology& grid, const StructuralMaterial& material);

// The mesh is repaired (mesh_repair.h) unless it is to be as drawn. One distance constraint per
// unique edge, one bending spring per inner edge between the two vertices opposite it, one hinge
// there with a bending rigidity, a third of each triangle's mass per corner. With a stretch
// stiffness E an edge of length l between triangles of area A in all has the stiffness E A / l^2: E
// along any direction of equilateral triangles (Van Gelder 1998, "Approximate simulation of elastic
// membranes by triangulated spring meshes"). Triangles with a repeated vertex or an area below
// 1e-12 of the squared longest edge are dropped and counted. Vertices without triangle are kept as
// particles with the mean mass of the others.
ParticleSystem BuildMesh(const TriangleMesh& mesh, const StructuralMaterial& material,
                         const MeshImport& import = {}, Interruption* interruption = nullptr);

// The rest length of a connection that has none of its own: the distance of its particles in the
// rest shape. 1 if that distance does not exist or is 0, so that only the cause (a bad index,
// particles that coincide) is reported.
double RestDistance_m(uint32_t i, uint32_t j, const std::vector<Eigen::Vector3d>& positions_m);

ParticleSystem BuildParticles(const ParticleTopology& particles);

// `interruption`: asked now and then; null: nobody is.
ParticleSystem BuildParticleSystem(const Topology& topology, const StructuralMaterial& material,
                                   const MeshImport& mesh_import = {},
                                   Interruption* interruption = nullptr);

}  // namespace drape
