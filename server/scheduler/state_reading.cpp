#include "server/scheduler/state_reading.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "server/core/check.h"

namespace drape {
namespace {

// Rows [first_row, first_row + rows) of a column of x, y, z; empty if the column is empty.
ScalarColumn Slice(const ScalarColumn& column, size_t first_row, size_t rows) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        std::decay_t<decltype(values)> slice;
        if (!values.empty()) {
          const auto begin = values.begin() + static_cast<std::ptrdiff_t>(3 * first_row);
          slice.assign(begin, begin + static_cast<std::ptrdiff_t>(3 * rows));
        }
        return slice;
      },
      column);
}

// The given rows of a column of x, y, z; empty if the column is empty.
ScalarColumn Pick(const ScalarColumn& column, const std::vector<size_t>& rows) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        std::decay_t<decltype(values)> picked;
        if (values.empty()) return picked;
        picked.reserve(3 * rows.size());
        for (const size_t row : rows) {
          for (size_t axis = 0; axis < 3; ++axis) picked.push_back(values[3 * row + axis]);
        }
        return picked;
      },
      column);
}

bool HasMergedVertices(ClothSpan cloths) {
  return std::ranges::any_of(
      cloths, [](const auto& cloth) { return cloth->model()->has_merged_vertices(); });
}

size_t RowTotal(ClothSpan cloths, const StateFields& fields) {
  size_t total = 0;
  for (const auto& cloth : cloths) total += fields.RowsOf(cloth->particle_count());
  return total;
}

std::vector<ClothHandle> HandlesOf(std::span<const ClothSpan> receivers) {
  std::vector<ClothHandle> handles;
  for (const ClothSpan& cloths : receivers) {
    for (const auto& cloth : cloths) handles.push_back(cloth->handle());
  }
  return handles;
}

ClothStates Read(Backend& backend, ClothSpan cloths, const StateFields& fields, RowsAre rows_are) {
  ClothStates states;
  for (const auto& cloth : cloths) states.cloths.push_back(StampOf(*cloth));
  SharedRead read(backend, std::span(&cloths, 1), fields, rows_are);
  states.columns = std::move(read.Take().front());
  return states;
}

}  // namespace

SharedRead::SharedRead(Backend& backend, std::span<const ClothSpan> receivers,
                       const StateFields& fields, RowsAre rows_are) {
  const std::vector<ClothHandle> handles = HandlesOf(receivers);
  const bool is_mapped =
      rows_are == RowsAre::kDescribed && std::ranges::any_of(receivers, HasMergedVertices);
  // A view of some particles names different ones in each cloth then, so all are read.
  const std::span<const uint32_t> particles =
      is_mapped ? std::span<const uint32_t>() : std::span(fields.particles);
  read_ = BeginRead(backend, {handles, fields.positions, fields.velocities, particles});
  for (const ClothSpan& cloths : receivers) {
    rows_.push_back(RowTotal(cloths, fields));
    if (!is_mapped) continue;
    for (const auto& cloth : cloths) cloths_.push_back({cloth->model(), rows_.size() - 1});
  }
  if (is_mapped) particles_ = fields.particles;
}

std::vector<StateColumns> SharedRead::Take() {
  StateColumns all = read_->Take();
  if (!cloths_.empty()) return Described(all);
  std::vector<StateColumns> columns;
  if (rows_.size() == 1) {  // the usual case, without a copy
    columns.push_back(std::move(all));
    return columns;
  }
  size_t first_row = 0;
  for (const size_t rows : rows_) {
    columns.push_back(
        {Slice(all.positions_m, first_row, rows), Slice(all.velocities_m_per_s, first_row, rows)});
    first_row += rows;
  }
  return columns;
}

std::vector<StateColumns> SharedRead::Described(const StateColumns& all) const {
  std::vector<std::vector<size_t>> rows(rows_.size());  // of the backend, for each receiver
  size_t first_row = 0;
  for (const ClothRows& cloth : cloths_) {
    const SceneModel& model = *cloth.model;
    const uint32_t count = RowsOf(particles_, model.described_particle_count());
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t described = particles_.empty() ? k : particles_[k];
      rows[cloth.receiver].push_back(first_row + model.ParticleOf(described));
    }
    first_row += model.particle_count();
  }
  std::vector<StateColumns> columns;
  for (const std::vector<size_t>& of_receiver : rows) {
    columns.push_back(
        {Pick(all.positions_m, of_receiver), Pick(all.velocities_m_per_s, of_receiver)});
  }
  return columns;
}

ClothStates ReadClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields) {
  return Read(backend, cloths, fields, RowsAre::kDescribed);
}

ClothStates ReadForPicture(Backend& backend, ClothSpan cloths, const StateFields& fields,
                           bool on_device) {
  DRAPE_CHECK(fields.particles.empty(), "pictures are of whole cloths");
  DeviceBackend* const device = on_device ? backend.device() : nullptr;
  if (device == nullptr) return Read(backend, cloths, fields, RowsAre::kParticles);
  const std::vector<ClothHandle> handles = HandlesOf(std::span(&cloths, 1));
  auto copy = device->CopyOnDevice({handles, fields.positions, fields.velocities});
  if (copy == nullptr) return Read(backend, cloths, fields, RowsAre::kParticles);
  ClothStates states;
  for (const auto& cloth : cloths) states.cloths.push_back(StampOf(*cloth));
  states.on_device = std::move(copy);
  return states;
}

}  // namespace drape
