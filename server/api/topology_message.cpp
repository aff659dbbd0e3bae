#include "server/api/topology_message.h"

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <numeric>
#include <span>
#include <vector>

#include "server/scene/distance_map.h"

namespace drape::api {
namespace {

template <class T>
void AppendBytes(T value, std::string* data) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  data->append(bytes, sizeof(T));
}

void BeginArray(v1::PackedArray::DataType type, size_t rows, uint32_t columns,
                v1::PackedArray* array) {
  array->set_data_type(type);
  array->add_shape(static_cast<uint32_t>(rows));
  array->add_shape(columns);
}

template <class Rows>
void SetPositions(size_t count, const Rows& row, v1::PackedArray* array) {
  BeginArray(v1::PackedArray::FLOAT64, count, 3, array);
  array->mutable_data()->reserve(count * 3 * sizeof(double));
  for (size_t k = 0; k < count; ++k) {
    for (int axis = 0; axis < 3; ++axis) AppendBytes(row(k)[axis], array->mutable_data());
  }
}

// In the order of the description, not of the colours.
void SetEdges(const SceneModel& model, v1::Topology& message) {
  const std::span<const uint32_t> sources = model.constraint_sources();
  std::vector<uint32_t> order(sources.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](uint32_t k) { return sources[k]; });
  BeginArray(v1::PackedArray::UINT32, order.size(), 2, message.mutable_edges());
  v1::PackedArray& indices = *message.mutable_edge_constraints();
  indices.set_data_type(v1::PackedArray::UINT32);
  indices.add_shape(static_cast<uint32_t>(order.size()));
  for (const uint32_t k : order) {
    const DistanceConstraint& constraint = model.constraints()[k];
    for (const uint32_t end : {constraint.i, constraint.j}) {
      AppendBytes(model.DescribedOf(end), message.mutable_edges()->mutable_data());
    }
    AppendBytes(sources[k], indices.mutable_data());
  }
}

}  // namespace

v1::Mesh MeshMessage(const TriangleMesh& mesh) {
  v1::Mesh message;
  SetPositions(
      mesh.positions_m.size(), [&](size_t k) { return mesh.positions_m[k]; },
      message.mutable_positions_m());
  BeginArray(v1::PackedArray::UINT32, mesh.triangles.size(), 3, message.mutable_triangles());
  for (const auto& corners : mesh.triangles) {
    for (const uint32_t corner : corners)
      AppendBytes(corner, message.mutable_triangles()->mutable_data());
  }
  return message;
}

v1::Topology TopologyOf(const ClothRecord& cloth) {
  const auto description = cloth.description();
  const SceneModel& model = *description->model;
  v1::Topology message;
  message.set_cloth_id(cloth.id.Packed());
  message.set_particles(model.described_particle_count());
  message.set_grid_columns(model.grid_columns());
  message.set_grid_rows(model.grid_rows());
  SetPositions(
      model.described_particle_count(),
      [&](size_t k) {
        return model.rest_positions_m()[model.ParticleOf(static_cast<uint32_t>(k))];
      },
      message.mutable_rest_positions_m());
  BeginArray(v1::PackedArray::UINT32, model.triangles().size(), 3, message.mutable_triangles());
  for (const auto& corners : model.triangles()) {
    for (const uint32_t corner : corners) {
      AppendBytes(model.DescribedOf(corner), message.mutable_triangles()->mutable_data());
    }
  }
  SetEdges(model, message);
  const std::vector<Collider>& colliders = description->parameters.colliders;
  for (size_t k = 0; k < colliders.size(); ++k) {
    const auto map = MapOf(colliders[k]);
    if (map == nullptr) continue;
    v1::Topology::ColliderMesh* mesh = message.add_collider_meshes();
    mesh->set_collider(static_cast<uint32_t>(k));
    *mesh->mutable_mesh() = MeshMessage(map->mesh());
  }
  return message;
}

}  // namespace drape::api
