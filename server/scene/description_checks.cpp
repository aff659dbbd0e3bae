#include "server/scene/description_checks.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "server/scene/structural_fields.h"

namespace drape {

namespace {

constexpr Range kParticleMass{kMinParticleMass_kg, kMaxParticleMass_kg, "kg"};

// Sizes are checked before anything is allocated; arithmetic in 64 bits.
void CheckCount(std::string_view field, uint64_t count, uint64_t max, std::string_view what,
                Violations& violations) {
  if (count > max) {
    violations.Add(FieldPath(field), fmt::format("{} {}; at most {}", count, what, max));
  }
}

void CheckSizes(const GridTopology& grid, const ModelLimits& limits, Violations& violations) {
  if (grid.columns < 1) violations.Add("grid.columns", "0 is not >= 1");
  if (grid.rows < 1) violations.Add("grid.rows", "0 is not >= 1");
  if (!violations.is_empty()) return;
  const uint64_t count = uint64_t{grid.columns} * grid.rows;
  if (count < 2)
    violations.Add("grid.columns", "a grid of 1 particle; columns * rows must be >= 2");
  CheckCount("grid.columns", count, limits.max_particles, "particles (columns * rows)", violations);
}

void CheckSizes(const TriangleMesh& mesh, const ModelLimits& limits, Violations& violations) {
  CheckCount("mesh.positions_m", mesh.positions_m.size(), limits.max_particles, "vertices",
             violations);
  if (mesh.triangles.empty()) violations.Add("mesh.triangles", "0 triangles; at least 1");
  // Every triangle brings at most three new edges.
  CheckCount("mesh.triangles", mesh.triangles.size(), limits.max_constraints, "triangles",
             violations);
}

void CheckSizes(const ParticleTopology& particles, const ModelLimits& limits,
                Violations& violations) {
  const size_t count = particles.positions_m.size();
  if (count == 0) violations.Add("particles.positions_m", "0 particles; at least 1");
  CheckCount("particles.positions_m", count, limits.max_particles, "particles", violations);
  if (particles.masses_kg.size() != count) {
    violations.Add("particles.masses_kg",
                   fmt::format("{} masses for {} particles", particles.masses_kg.size(), count));
  }
  CheckCount("particles.distance_constraints", particles.distance_constraints.size(),
             limits.max_constraints, "constraints", violations);
  CheckCount("particles.springs", particles.springs.size(), limits.max_constraints, "springs",
             violations);
  CheckCount("particles.point_joints", particles.point_joints.size(), limits.max_constraints,
             "joints", violations);
}

void CheckPositions(std::string_view field, const std::vector<Eigen::Vector3d>& positions,
                    Violations& violations) {
  for (size_t k = 0; k < positions.size() && !violations.is_full(); ++k) {
    const Eigen::Vector3d& p = positions[k];
    // The comparison is false for NaN.
    if ((p.array().abs() <= kMaxExtent_m).all()) continue;
    const Range range{-kMaxExtent_m, kMaxExtent_m, "m"};
    violations.Add(FieldPath(field).At(k),
                   fmt::format("({}, {}, {}) is not in {}", p.x(), p.y(), p.z(), range.ToString()));
  }
}

void CheckValues(const GridTopology& grid, Violations& violations) {
  violations.InRange("grid.width_m", grid.width_m, Positive(kMaxExtent_m, "m"));
  violations.InRange("grid.height_m", grid.height_m, Positive(kMaxExtent_m, "m"));
}

void CheckValues(const TriangleMesh& mesh, Violations& violations) {
  CheckMeshValues(mesh, violations);
}

// Both ends of a constraint or spring; `field` is e.g. "particles.springs[0]".
void CheckEnds(const FieldPath& field, uint32_t i, uint32_t j, size_t count,
               Violations& violations) {
  violations.IsParticle(field.Child("i"), i, count);
  violations.IsParticle(field.Child("j"), j, count);
  if (i == j)
    violations.Add(field.Child("j"), fmt::format("{} equals i; must be another particle", j));
}

bool IsCoefficient(double value) {
  return value >= 0 && value <= kMaxCoefficient;
}

void CheckConstraint(size_t index, const DistanceConstraint& constraint,
                     const ParticleTopology& particles, Violations& violations) {
  const auto [i, j, rest_length, compliance, kind] = constraint;
  const size_t count = particles.positions_m.size();
  const bool has_good_ends = i < count && j < count && i != j;
  const bool has_good_values =
      rest_length >= kMinRestLength_m && rest_length <= kMaxExtent_m && IsCoefficient(compliance);
  const bool is_apart = has_good_ends && particles.positions_m[i] != particles.positions_m[j];
  if (has_good_values && is_apart) return;  // the text is made for bad constraints only

  const FieldPath field = FieldPath("particles.distance_constraints").At(index);
  CheckEnds(field, i, j, count, violations);
  violations.InRange(field.Child("rest_length_m"), rest_length,
                     {kMinRestLength_m, kMaxExtent_m, "m"});
  violations.InRange(field.Child("compliance_m_per_n"), compliance, {0, kMaxCoefficient, "m/N"});
  if (has_good_ends && !is_apart) {
    violations.Add(
        field, fmt::format("particles {} and {} coincide; joined particles must be apart", i, j));
  }
}

void CheckJoint(size_t index, const PointJoint& joint, size_t count, Violations& violations) {
  const auto [i, j, compliance] = joint;
  if (i < count && j < count && i != j && IsCoefficient(compliance)) return;
  const FieldPath field = FieldPath("particles.point_joints").At(index);
  CheckEnds(field, i, j, count, violations);
  violations.InRange(field.Child("compliance_m_per_n"), compliance, {0, kMaxCoefficient, "m/N"});
}

void CheckSpring(size_t index, const Spring& spring, size_t count, Violations& violations) {
  const auto [i, j, rest_length, stiffness, damping] = spring;
  const bool is_good = i < count && j < count && i != j && rest_length >= 0 &&
                       rest_length <= kMaxExtent_m && IsCoefficient(stiffness) &&
                       IsCoefficient(damping);
  if (is_good) return;
  const FieldPath field = FieldPath("particles.springs").At(index);
  CheckEnds(field, i, j, count, violations);
  violations.InRange(field.Child("rest_length_m"), rest_length, {0, kMaxExtent_m, "m"});
  violations.InRange(field.Child("stiffness_n_per_m"), stiffness, {0, kMaxCoefficient, "N/m"});
  violations.InRange(field.Child("damping_n_s_per_m"), damping, {0, kMaxCoefficient, "N s/m"});
}

void CheckValues(const ParticleTopology& particles, Violations& violations) {
  CheckPositions("particles.positions_m", particles.positions_m, violations);
  for (size_t k = 0; k < particles.masses_kg.size() && !violations.is_full(); ++k) {
    violations.InRange(FieldPath("particles.masses_kg").At(k), particles.masses_kg[k],
                       kParticleMass);
  }
  for (size_t k = 0; k < particles.distance_constraints.size() && !violations.is_full(); ++k) {
    CheckConstraint(k, particles.distance_constraints[k], particles, violations);
  }
  for (size_t k = 0; k < particles.springs.size() && !violations.is_full(); ++k) {
    CheckSpring(k, particles.springs[k], particles.positions_m.size(), violations);
  }
  for (size_t k = 0; k < particles.point_joints.size() && !violations.is_full(); ++k) {
    CheckJoint(k, particles.point_joints[k], particles.positions_m.size(), violations);
  }
}

void CheckMaterial(const StructuralMaterial& material, Violations& violations) {
  for (const StructuralField& field : kStructuralFields) {
    violations.InRange(FieldPath("material").Child(field.name), material.*field.member,
                       field.range);
  }
}

// Two fields for the same property.
void CheckChoices(const StructuralMaterial& material, Violations& violations) {
  if (material.stretch_stiffness_n_per_m > 0 && material.stretch_compliance_m_per_n > 0) {
    violations.Add(
        "material.stretch_stiffness_n_per_m",
        fmt::format("{} N/m together with material.stretch_compliance_m_per_n {} m/N; at "
                    "most one of the two may be other than 0",
                    material.stretch_stiffness_n_per_m, material.stretch_compliance_m_per_n));
  }
  if (material.shear_modulus_n_per_m > 0 && material.shear_stiffness_n_per_m > 0) {
    violations.Add(
        "material.shear_modulus_n_per_m",
        fmt::format("{} N/m together with material.shear_stiffness_n_per_m {} N/m; at most one of "
                    "the two may be other than 0",
                    material.shear_modulus_n_per_m, material.shear_stiffness_n_per_m));
  }
}

// Refuses fields that would do nothing.
void CheckFits(const ModelDescription& description, Violations& violations) {
  for (const StructuralField& field : kStructuralFields) {
    const double value = description.material.*field.member;
    if (!field.is_refused_elsewhere || value == 0 || Has(description.topology, field)) continue;
    violations.Add(FieldPath("material").Child(field.name),
                   fmt::format("{} belongs to {}; must be 0 here", value, OwnersOf(field)));
  }
}

uint64_t ParticleCount(const Topology& topology) {
  if (const auto* grid = std::get_if<GridTopology>(&topology)) {
    return uint64_t{grid->columns} * grid->rows;
  }
  if (const auto* mesh = std::get_if<TriangleMesh>(&topology)) return mesh->positions_m.size();
  return std::get<ParticleTopology>(topology).positions_m.size();
}

void CheckPins(const ModelDescription& description, Violations& violations) {
  const uint64_t count = ParticleCount(description.topology);
  const auto& pins = description.pinned_particles;
  std::vector<bool> is_pinned(count, false);
  for (size_t k = 0; k < pins.size() && !violations.is_full(); ++k) {
    const FieldPath field = FieldPath("pins").At(k).Child("particle");
    if (!violations.IsParticle(field, pins[k], count)) continue;
    violations.Require(!is_pinned[pins[k]], field, [&] {
      return fmt::format("{} is pinned already; each particle at most once", pins[k]);
    });
    is_pinned[pins[k]] = true;
  }
}

// The field that a client can change to correct the masses, rest lengths and degrees of a topology.
struct TopologyFields {
  std::string_view masses;
  std::string_view lengths;
  std::string_view constraints;
  std::string_view springs;
};

TopologyFields FieldsOf(const Topology& topology) {
  if (std::holds_alternative<GridTopology>(topology)) {
    return {"material.areal_density_kg_per_m2", "grid.width_m", "grid.columns", "grid.columns"};
  }
  if (std::holds_alternative<TriangleMesh>(topology)) {
    return {"material.areal_density_kg_per_m2", "mesh.positions_m", "mesh.triangles",
            "mesh.triangles"};
  }
  return {"particles.masses_kg", "particles.distance_constraints", "particles.distance_constraints",
          "particles.springs"};
}

// "particle 3 has 1025 springs; at most 1024", of the particle, or vertex, that has most. Whether
// it is legal.
bool CheckLargest(std::string_view field, const std::vector<uint32_t>& degrees, uint32_t max_degree,
                  std::string_view subject, std::string_view what, Violations& violations) {
  const auto largest = std::max_element(degrees.begin(), degrees.end());
  if (largest == degrees.end() || *largest <= max_degree) return true;
  violations.Add(FieldPath(field),
                 fmt::format("{} {} has {} {}; at most {}", subject, largest - degrees.begin(),
                             *largest, what, max_degree));
  return false;
}

// `connections`: distance constraints or springs.
template <class Connection>
void CheckDegrees(std::string_view field, const std::vector<Connection>& connections,
                  size_t particle_count, uint32_t max_degree, std::string_view what,
                  Violations& violations) {
  std::vector<uint32_t> degrees(particle_count, 0);
  for (const Connection& connection : connections) {
    ++degrees[connection.i];
    ++degrees[connection.j];
  }
  CheckLargest(field, degrees, max_degree, "particle", what, violations);
}

// The triangles at one particle, and the sum of their squares: how many pairs of triangles meet at
// the particles, which self-collision looks at. It is about 18 for each triangle of a mesh without
// holes, and more where very many meet at a point.
void CheckTriangles(const ParticleSystem& system, uint32_t max_degree, Violations& violations) {
  constexpr uint64_t kMaxPairsPerTriangle = 32;
  constexpr uint64_t kMorePairs = uint64_t{1} << 22;  // four points of 1024 triangles
  std::vector<uint32_t> degrees(system.rest_positions_m.size(), 0);
  for (const auto& triangle : system.triangles) {
    for (const uint32_t vertex : triangle) ++degrees[vertex];
  }
  if (!CheckLargest("mesh.triangles", degrees, max_degree, "particle", "triangles", violations)) {
    return;
  }
  uint64_t pairs = 0;
  for (const uint64_t degree : degrees) pairs += degree * degree;
  const uint64_t limit = kMaxPairsPerTriangle * system.triangles.size() + kMorePairs;
  if (pairs <= limit) return;
  violations.Add("mesh.triangles",
                 fmt::format("very many triangles meet at too many vertices: their squared numbers "
                             "add up to {}; at most {} for {} triangles",
                             pairs, limit, system.triangles.size()));
}

// Before the mesh is repaired and built, which takes long for what would be refused.
void CheckDrawnTriangles(const TriangleMesh& mesh, uint32_t max_degree, Violations& violations) {
  std::vector<uint32_t> degrees(mesh.positions_m.size(), 0);
  for (const auto& [i, j, k] : mesh.triangles) {
    if (i == j || j == k || k == i) continue;  // has no area
    for (const uint32_t vertex : {i, j, k}) ++degrees[vertex];
  }
  CheckLargest("mesh.triangles", degrees, max_degree, "vertex", "triangles", violations);
}

// The limit is that of springs, for the same reason.
void CheckElasticDegrees(const ParticleSystem& system, uint32_t max_degree,
                         Violations& violations) {
  std::vector<uint32_t> degrees(system.rest_positions_m.size(), 0);
  for (const ElasticElement& element : system.elastic_elements) {
    for (size_t k = 0; k < element.particles.size(); ++k) {
      if (element.weights[k] != 0) ++degrees[element.particles[k]];
    }
  }
  CheckLargest("material.bending_rigidity_n_m", degrees, max_degree, "particle",
               "elastic elements of bending", violations);
}

}  // namespace

void CheckMeshValues(const TriangleMesh& mesh, Violations& violations) {
  CheckPositions("mesh.positions_m", mesh.positions_m, violations);
  for (size_t t = 0; t < mesh.triangles.size() && !violations.is_full(); ++t) {
    for (const uint32_t vertex : mesh.triangles[t]) {
      if (vertex < mesh.positions_m.size()) continue;
      violations.IsParticle(FieldPath("mesh.triangles").At(t), vertex, mesh.positions_m.size());
      break;
    }
  }
}

std::vector<FieldViolation> CheckDescription(const ModelDescription& description,
                                             const ModelLimits& limits) {
  Violations violations;
  std::visit([&](const auto& topology) { CheckSizes(topology, limits, violations); },
             description.topology);
  if (!violations.is_empty()) return violations.Take();
  std::visit([&](const auto& topology) { CheckValues(topology, violations); },
             description.topology);
  if (const auto* mesh = std::get_if<TriangleMesh>(&description.topology);
      mesh != nullptr && violations.is_empty()) {
    CheckDrawnTriangles(*mesh, limits.max_degree, violations);
  }
  CheckMaterial(description.material, violations);
  CheckChoices(description.material, violations);
  CheckFits(description, violations);
  CheckPins(description, violations);
  return violations.Take();
}

std::vector<FieldViolation> CheckLetOut(const ModelDescription& description,
                                        size_t constraint_count) {
  Violations violations;
  for (size_t k = 0; k < description.let_out.size() && !violations.is_full(); ++k) {
    const LetOutLink& link = description.let_out[k];
    const FieldPath path = FieldPath("let_out").At(k);
    violations.Require(link.constraint < constraint_count, path, [&] {
      return fmt::format("names constraint {} of {}", link.constraint, constraint_count);
    });
    violations.InRange(path, link.rest_length_m, {kMinRestLength_m, kMaxExtent_m, "m"});
  }
  return violations.Take();
}

std::vector<FieldViolation> CheckParticleSystem(const ModelDescription& description,
                                                const ParticleSystem& system,
                                                const ModelLimits& limits) {
  Violations violations;
  if (std::holds_alternative<TriangleMesh>(description.topology) && system.triangles.empty()) {
    violations.Add("mesh.triangles",
                   fmt::format("all {} triangles have no area; at least 1 must have one",
                               system.dropped_triangles));
    return violations.Take();
  }
  if (const auto& edge = system.crowded_edge) {
    violations.Add(
        "mesh.triangles",
        fmt::format("the edge of particles {} and {} has {} triangles; at most {}", edge->i,
                    edge->j, edge->opposite_vertices.size(), kMaxTrianglesAtEdge));
    return violations.Take();
  }
  const TopologyFields fields = FieldsOf(description.topology);
  for (const double mass : system.masses_kg) {
    if (kParticleMass.Contains(mass)) continue;
    violations.Add(FieldPath(fields.masses),
                   fmt::format("gives a particle of {} kg, which is not in {}", mass,
                               kParticleMass.ToString()));
    break;
  }
  for (const DistanceConstraint& constraint : system.distance_constraints) {
    if (constraint.rest_length_m >= kMinRestLength_m) continue;
    violations.Add(
        FieldPath(fields.lengths),
        fmt::format("particles {} and {} are {} m apart; joined particles at least {} m",
                    constraint.i, constraint.j, constraint.rest_length_m, kMinRestLength_m));
    break;
  }
  CheckCount(fields.constraints, system.distance_constraints.size(), limits.max_constraints,
             "distance constraints", violations);
  for (const DistanceConstraint& constraint : system.distance_constraints) {
    if (constraint.compliance_m_per_n <= kMaxCoefficient) continue;
    violations.Add("material.stretch_stiffness_n_per_m",
                   fmt::format("gives an edge the compliance {} m/N; at most {} m/N",
                               constraint.compliance_m_per_n, kMaxCoefficient));
    break;
  }
  CheckCount(fields.springs, system.springs.size(), limits.max_constraints, "springs", violations);
  CheckCount("material.bending_rigidity_n_m", system.elastic_elements.size(),
             limits.max_constraints, "elastic elements of bending and shear", violations);
  const size_t count = system.rest_positions_m.size();
  CheckDegrees(fields.constraints, system.distance_constraints, count, limits.max_degree,
               "distance constraints", violations);
  CheckDegrees(fields.springs, system.springs, count, limits.max_degree, "springs", violations);
  CheckElasticDegrees(system, limits.max_degree, violations);
  CheckTriangles(system, limits.max_degree, violations);
  CheckDegrees("particles.point_joints", system.point_joints, count, limits.max_degree, "joints",
               violations);
  return violations.Take();
}

}  // namespace drape
