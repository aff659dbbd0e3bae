#include "client/cli/topology.h"

#include <cstring>

namespace drape::cli {
namespace {

Topology OfGrid(const v1::Grid& grid) {
  Topology topology;
  const uint32_t columns = grid.columns();
  const uint32_t rows = grid.rows();
  if (columns == 1 || rows == 1) {
    for (uint32_t i = 0; i + 1 < columns * rows; ++i) topology.lines.push_back({i, i + 1});
    return topology;
  }
  for (uint32_t row = 0; row + 1 < rows; ++row) {
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t i = row * columns + column;
      // z cross x points up.
      topology.triangles.push_back({i, i + columns, i + 1});
      topology.triangles.push_back({i + 1, i + columns, i + columns + 1});
    }
  }
  return topology;
}

Topology OfMesh(const v1::Mesh& mesh) {
  Topology topology;
  const std::string& bytes = mesh.triangles().data();
  topology.triangles.resize(bytes.size() / sizeof(std::array<uint32_t, 3>));
  std::memcpy(topology.triangles.data(), bytes.data(),
              topology.triangles.size() * sizeof(std::array<uint32_t, 3>));
  return topology;
}

}  // namespace

Topology TopologyOf(const v1::ClothSpec& spec) {
  if (spec.has_grid()) return OfGrid(spec.grid());
  if (spec.has_mesh()) return OfMesh(spec.mesh());
  Topology topology;
  for (const v1::DistanceConstraint& constraint : spec.particles().distance_constraints()) {
    topology.lines.push_back({constraint.i(), constraint.j()});
  }
  return topology;
}

}  // namespace drape::cli
