#include "server/api/topology_validation.h"

#include <bit>
#include <cstring>

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

std::optional<TriangleMesh> ReadMesh(const FieldPath& path, const v1::Mesh& mesh,
                                     FieldChecks& checks) {
  const auto vertices = checks.PackedRows(path.Child("positions_m"), mesh.positions_m(),
                                          {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64}, 3);
  const auto triangles =
      checks.PackedRows(path.Child("triangles"), mesh.triangles(), {v1::PackedArray::UINT32}, 3);
  if (!vertices || !triangles) return {};
  TriangleMesh result;
  result.positions_m.resize(*vertices);
  for (size_t k = 0; k < *vertices; ++k) {
    for (size_t axis = 0; axis < 3; ++axis) {
      result.positions_m[k][static_cast<Eigen::Index>(axis)] =
          Coordinate(mesh.positions_m(), 3 * k + axis);
    }
  }
  result.triangles.resize(*triangles);
  for (size_t k = 0; k < *triangles; ++k) {
    for (size_t corner = 0; corner < 3; ++corner) {
      result.triangles[k][corner] = Element<uint32_t>(mesh.triangles(), 3 * k + corner);
    }
  }
  return result;
}

// The length between two particles of the rest shape, where a rest length is unset. 1 where there
// is no length to take, so that only the cause (a bad index, particles that coincide) is reported.
double DefaultRestLength_m(uint32_t i, uint32_t j,
                           const std::vector<Eigen::Vector3d>& positions_m) {
  if (i >= positions_m.size() || j >= positions_m.size()) return 1;
  const double length_m = (positions_m[i] - positions_m[j]).norm();
  return length_m > 0 ? length_m : 1;
}

std::optional<ParticleTopology> ReadParticles(const FieldPath& path, const v1::Particles& particles,
                                              FieldChecks& checks) {
  const size_t numbers = particles.positions_m_size();
  if (!checks.Require(numbers % 3 == 0, path.Child("positions_m"), [&] {
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
  for (const v1::DistanceConstraint& constraint : particles.distance_constraints()) {
    const auto i = constraint.i(), j = constraint.j();
    result.distance_constraints.push_back({i, j,
                                           constraint.has_rest_length_m()
                                               ? constraint.rest_length_m()
                                               : DefaultRestLength_m(i, j, result.positions_m),
                                           constraint.compliance_m_per_n()});
  }
  for (const v1::Spring& spring : particles.springs()) {
    const auto i = spring.i(), j = spring.j();
    result.springs.push_back({i, j,
                              spring.has_rest_length_m()
                                  ? spring.rest_length_m()
                                  : DefaultRestLength_m(i, j, result.positions_m),
                              spring.stiffness_n_per_m(), spring.damping_n_s_per_m()});
  }
  return result;
}

}  // namespace

std::optional<Topology> ReadTopology(const FieldPath& path, const v1::ClothSpec& spec,
                                     FieldChecks& checks) {
  if (spec.has_scale_m()) {
    checks.Add(path.Child("scale_m"), "belongs to mesh_file, which only scene files may have");
  }
  switch (spec.topology_case()) {
    case v1::ClothSpec::kGrid:
      return ReadGrid(spec.grid());
    case v1::ClothSpec::kMesh:
      return ReadMesh(path.Child("mesh"), spec.mesh(), checks);
    case v1::ClothSpec::kParticles:
      return ReadParticles(path.Child("particles"), spec.particles(), checks);
    case v1::ClothSpec::kMeshFile:
      checks.Add(path.Child("mesh_file"),
                 "a server reads no files: the client reads the file and sends `mesh`");
      return {};
    case v1::ClothSpec::TOPOLOGY_NOT_SET:
      break;
  }
  checks.Add(path, "no topology is set: one of grid, mesh, particles is needed");
  return {};
}

}  // namespace drape::api
