#include "server/api/topology_validation.h"

#include <bit>
#include <cstring>

#include "server/scene/constraint_builder.h"

namespace drape::api {
namespace {

static_assert(std::endian::native == std::endian::little,
              "packed arrays are little-endian and copied as they are");

// Element k of a packed array whose length is checked.
template <class T>
T Element(const v1::PackedArray& array, size_t k) {
  T value;
  std::memcpy(&value, array.data().data() + k * sizeof(T), sizeof(T));
  return value;
}

double Coordinate(const v1::PackedArray& array, size_t k) {
  return array.data_type() == v1::PackedArray::FLOAT64 ? Element<double>(array, k)
                                                       : double{Element<float>(array, k)};
}

GridTopology ReadGrid(const v1::Grid& grid) {
  return {grid.columns(), grid.rows(), grid.width_m(), grid.height_m()};
}

ConstraintKind ReadKind(v1::DistanceConstraint::Kind kind) {
  if (kind == v1::DistanceConstraint::AT_MOST) return ConstraintKind::kAtMost;
  if (kind == v1::DistanceConstraint::AT_LEAST) return ConstraintKind::kAtLeast;
  return ConstraintKind::kEqual;
}

std::optional<ParticleTopology> ReadParticles(const FieldPath& path, const v1::Particles& particles,
                                              Violations& violations) {
  const size_t numbers = particles.positions_m_size();
  if (!violations.Require(numbers % 3 == 0, path.Child("positions_m"), [&] {
        return "has " + std::to_string(numbers) +
               " elements, needs a multiple of 3 (x, y, z per particle)";
      })) {
    return {};
  }
  ParticleTopology result;
  for (size_t k = 0; k < numbers; k += 3) {
    const double* p = particles.positions_m().data() + k;
    result.positions_m.emplace_back(p[0], p[1], p[2]);
  }
  result.masses_kg.assign(particles.masses_kg().begin(), particles.masses_kg().end());
  result.distance_constraints = ReadConstraints(path, particles, violations);
  for (int k = 0; k < particles.distance_constraints_size(); ++k) {
    if (particles.distance_constraints(k).has_rest_length_m()) continue;
    DistanceConstraint& constraint = result.distance_constraints[static_cast<size_t>(k)];
    constraint.rest_length_m = RestDistance_m(constraint.i, constraint.j, result.positions_m);
  }
  result.springs = ReadSprings(particles);
  for (int k = 0; k < particles.springs_size(); ++k) {
    if (particles.springs(k).has_rest_length_m()) continue;
    Spring& spring = result.springs[static_cast<size_t>(k)];
    spring.rest_length_m = RestDistance_m(spring.i, spring.j, result.positions_m);
  }
  result.point_joints = ReadJoints(particles);
  return result;
}

}  // namespace

bool CheckMeshArrays(const FieldPath& path, const v1::Mesh& mesh, Violations& violations) {
  const auto vertices =
      CheckPackedRows(path.Child("positions_m"), mesh.positions_m(),
                      {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64}, 3, violations);
  const auto triangles = CheckPackedRows(path.Child("triangles"), mesh.triangles(),
                                         {v1::PackedArray::UINT32}, 3, violations);
  return vertices && triangles;
}

TriangleMesh ToTriangleMesh(const v1::Mesh& mesh) {
  TriangleMesh result;
  result.positions_m.resize(mesh.positions_m().shape(0));
  for (size_t k = 0; k < result.positions_m.size(); ++k) {
    for (size_t axis = 0; axis < 3; ++axis) {
      result.positions_m[k][static_cast<Eigen::Index>(axis)] =
          Coordinate(mesh.positions_m(), 3 * k + axis);
    }
  }
  result.triangles.resize(mesh.triangles().shape(0));
  for (size_t k = 0; k < result.triangles.size(); ++k) {
    for (size_t corner = 0; corner < 3; ++corner) {
      result.triangles[k][corner] = Element<uint32_t>(mesh.triangles(), 3 * k + corner);
    }
  }
  return result;
}

std::vector<DistanceConstraint> ReadConstraints(const FieldPath& path,
                                                const v1::Particles& particles,
                                                Violations& violations) {
  std::vector<DistanceConstraint> result;
  for (int k = 0; k < particles.distance_constraints_size(); ++k) {
    const v1::DistanceConstraint& constraint = particles.distance_constraints(k);
    if (constraint.kind() != v1::DistanceConstraint::KIND_UNSPECIFIED) {
      CheckKnownEnum(path.Child("distance_constraints").At(static_cast<size_t>(k)).Child("kind"),
                     constraint.kind(), v1::DistanceConstraint::Kind_descriptor(), violations);
    }
    result.push_back({constraint.i(), constraint.j(), constraint.rest_length_m(),
                      constraint.compliance_m_per_n(), ReadKind(constraint.kind())});
  }
  return result;
}

std::vector<Spring> ReadSprings(const v1::Particles& particles) {
  std::vector<Spring> result;
  for (const v1::Spring& spring : particles.springs()) {
    result.push_back({spring.i(), spring.j(), spring.rest_length_m(), spring.stiffness_n_per_m(),
                      spring.damping_n_s_per_m()});
  }
  return result;
}

std::vector<PointJoint> ReadJoints(const v1::Particles& particles) {
  std::vector<PointJoint> result;
  for (const v1::PointJoint& joint : particles.point_joints()) {
    result.push_back({joint.i(), joint.j(), joint.compliance_m_per_n()});
  }
  return result;
}

std::optional<Topology> ReadTopology(const FieldPath& path, const v1::ClothSpec& spec,
                                     Violations& violations) {
  switch (spec.topology_case()) {
    case v1::ClothSpec::kGrid:
      return ReadGrid(spec.grid());
    case v1::ClothSpec::kMesh:
      if (!CheckMeshArrays(path.Child("mesh"), spec.mesh(), violations)) return {};
      return ToTriangleMesh(spec.mesh());
    case v1::ClothSpec::kParticles:
      return ReadParticles(path.Child("particles"), spec.particles(), violations);
    case v1::ClothSpec::TOPOLOGY_NOT_SET:
      break;
  }
  violations.Add(path, "no topology is set: one of grid, mesh, particles is needed");
  return {};
}

}  // namespace drape::api
