// The description of a cloth in plain values: the input of SceneModel::Build. SI units, double
// precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

namespace drape {

// A rectangle in the xz plane at y = 0 from the origin; particle index = row * columns + column,
// x = column * width_m / (columns - 1), z = row * height_m / (rows - 1) (0 for a single line). The
// total mass areal density * width * height is shared equally.
struct GridTopology {
  uint32_t columns = 0;  // >= 1, and columns * rows >= 2
  uint32_t rows = 0;     // >= 1
  double width_m = 0;    // > 0
  double height_m = 0;   // > 0
};

// Indexed triangles, counter-clockwise seen from outside. Also the topology of mesh cloths.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> positions_m;        // [vertex_count]
  std::vector<std::array<uint32_t, 3>> triangles;  // [triangle_count][3]
};

// The kind of a distance constraint: equal to the length, at most the length (a rope), at least the
// length (a strut). As wide as the doubles beside it, so that DistanceConstraint has no padding.
enum class ConstraintKind : uint64_t { kEqual, kAtMost, kAtLeast };

// C = |p_i - p_j| - rest_length_m, softened by the compliance (0 = inextensible): C = 0, C <= 0 or
// C >= 0.
struct DistanceConstraint {
  uint32_t i = 0;
  uint32_t j = 0;
  double rest_length_m = 0;       // > 0
  double compliance_m_per_n = 0;  // >= 0
  ConstraintKind kind = ConstraintKind::kEqual;
};

// C = p_j - p_i = 0 in all three axes, softened by the compliance (0 = rigid). Particles that are
// apart in the rest shape are together when the cloth starts (start_positions.h).
struct PointJoint {
  uint32_t i = 0;
  uint32_t j = 0;
  double compliance_m_per_n = 0;  // >= 0
};

// Explicit spring-damper; force on i along the unit vector d from i to j:
// stiffness * (|p_j - p_i| - rest_length) + damping * d . (v_j - v_i).
struct Spring {
  uint32_t i = 0;
  uint32_t j = 0;
  double rest_length_m = 0;      // >= 0
  double stiffness_n_per_m = 0;  // >= 0
  double damping_n_s_per_m = 0;  // >= 0
};

// Free particles under explicit constraints, springs and joints (chains, nets, linkages).
struct ParticleTopology {
  std::vector<Eigen::Vector3d> positions_m;  // [particle_count]
  std::vector<double> masses_kg;             // [particle_count], each > 0
  std::vector<DistanceConstraint> distance_constraints;
  std::vector<Spring> springs;
  std::vector<PointJoint> point_joints{};
};

using Topology = std::variant<GridTopology, TriangleMesh, ParticleTopology>;

// The part of the material that shapes constraints, springs, elastic elements and masses. The first
// of each pair is per edge or spring, the second the same cloth at any resolution.
struct StructuralMaterial {
  double areal_density_kg_per_m2 = 0.2;   // > 0; grids and meshes
  double stretch_compliance_m_per_n = 0;  // >= 0; grids and meshes
  double stretch_stiffness_n_per_m =
      0;  // >= 0; grids and meshes; force per width and strain; 0: unset
  double bending_stiffness_n_per_m = 0;  // >= 0; grids and meshes, paper section 4.1
  double bending_rigidity_n_m = 0;       // >= 0; grids and meshes; moment per width and curvature
  double shear_stiffness_n_per_m = 0;    // >= 0; grids
  double shear_modulus_n_per_m = 0;      // >= 0; grids and meshes; shear modulus times thickness
};

// Stretch stiffness of meshes described without any [N/m]: that of woven fabrics, which stretch by
// a few tenths of a per cent under their weight. Triangles of inextensible edges can hardly bend,
// and contradict each other in motion. Stiffer: meshes do not come to rest; softer: visible
// stretch.
inline constexpr double kMeshStretchStiffness_n_per_m = 2000;

// A particle moved by the client.
struct Pin {
  uint32_t particle = 0;
  // In the cloth's environment; unset = where the particle starts.
  std::optional<Eigen::Vector3d> target_m;
};

// Rotation first, then translation.
struct RigidTransform {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + position_m; }

  bool operator==(const RigidTransform&) const = default;
};

// How a mesh becomes a cloth (mesh_import.md).
struct MeshImport {
  bool as_drawn = false;      // without repair (mesh_repair.h)
  bool keep_lengths = false;  // edges without room at the start are not let out (start_fitting.h)
  // Of a mesh with a shear modulus: along which its threads run, of any length (woven_edges.h).
  Eigen::Vector3d warp_direction = Eigen::Vector3d::UnitY();

  bool operator==(const MeshImport&) const = default;
};

// A distance constraint, by its place in the description, with another rest length.
struct LetOutLink {
  uint32_t constraint = 0;
  double rest_length_m = 0;  // > 0

  bool operator==(const LetOutLink&) const = default;
};

// Everything that SceneModel::Build needs. The pins' targets are not part of the model.
struct ModelDescription {
  Topology topology;
  StructuralMaterial material;
  std::vector<uint32_t> pinned_particles;  // any order, no duplicates
  MeshImport mesh_import{};
  std::vector<LetOutLink> let_out{};  // of a mesh, ascending: found where it starts
};

}  // namespace drape
