#include "server/scheduler/state_reading.h"

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

}  // namespace

SharedRead::SharedRead(Backend& backend, std::span<const ClothSpan> receivers,
                       const StateFields& fields) {
  const std::vector<ClothHandle> handles = HandlesOf(receivers);
  read_ = BeginRead(backend, {handles, fields.positions, fields.velocities, fields.particles});
  for (const ClothSpan& cloths : receivers) rows_.push_back(RowTotal(cloths, fields));
}

std::vector<StateColumns> SharedRead::Take() {
  StateColumns all = read_->Take();
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

ClothStates ReadClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields) {
  ClothStates states;
  for (const auto& cloth : cloths) states.cloths.push_back(StampOf(*cloth));
  states.columns = std::move(SharedRead(backend, std::span(&cloths, 1), fields).Take().front());
  return states;
}

ClothStates CopyClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields) {
  DRAPE_CHECK(fields.particles.empty(), "pictures are of whole cloths");
  DeviceBackend* const device = backend.device();
  if (device == nullptr) return ReadClothStates(backend, cloths, fields);
  const std::vector<ClothHandle> handles = HandlesOf(std::span(&cloths, 1));
  auto copy = device->CopyOnDevice({handles, fields.positions, fields.velocities});
  if (copy == nullptr) return ReadClothStates(backend, cloths, fields);
  ClothStates states;
  for (const auto& cloth : cloths) states.cloths.push_back(StampOf(*cloth));
  states.on_device = std::move(copy);
  return states;
}

}  // namespace drape
