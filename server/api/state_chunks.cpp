#include "server/api/state_chunks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "server/core/check.h"

namespace drape::api {
namespace {

uint64_t RowBytes(const ScalarColumn& column) {
  return std::visit(
      [](const auto& values) -> uint64_t { return values.empty() ? 0 : 3 * sizeof(values[0]); },
      column);
}

v1::PackedArray::DataType DataTypeOf(const ScalarColumn& column) {
  return std::holds_alternative<std::vector<double>>(column) ? v1::PackedArray::FLOAT64
                                                             : v1::PackedArray::FLOAT32;
}

// Adds `shift` in double precision, then rounds to the column's type. Without a shift they stay as
// they are.
template <class T>
void AppendShifted(const T* values, uint64_t row_count, const Eigen::Vector3d& shift,
                   std::string* data) {
  constexpr size_t kRowBytes = 3 * sizeof(T);
  if (shift.isZero(0)) {
    data->append(reinterpret_cast<const char*>(values), row_count * kRowBytes);
    return;
  }
  const size_t begin = data->size();
  data->resize(begin + row_count * kRowBytes);
  char* to = data->data() + begin;
  for (uint64_t k = 0; k < row_count; ++k, to += kRowBytes) {
    const std::array<T, 3> row = {static_cast<T>(double{values[3 * k]} + shift.x()),
                                  static_cast<T>(double{values[3 * k + 1]} + shift.y()),
                                  static_cast<T>(double{values[3 * k + 2]} + shift.z())};
    std::memcpy(to, row.data(), kRowBytes);
  }
}

// Reserves what a chunk that begins at `first_row` can hold: growing it step by step would copy it.
void ReserveRows(const ScalarColumn& column, uint64_t first_row, uint64_t max_rows,
                 v1::PackedArray* array) {
  const uint64_t rows = std::visit([](const auto& values) { return values.size() / 3; }, column);
  array->mutable_data()->reserve(std::min(rows - first_row, max_rows) * RowBytes(column));
}

void AppendColumn(const ScalarColumn& column, uint64_t first_row, uint64_t row_count,
                  const Eigen::Vector3d& shift, v1::PackedArray* array) {
  std::visit(
      [&](const auto& values) {
        AppendShifted(values.data() + 3 * first_row, row_count, shift, array->mutable_data());
      },
      column);
}

void FinishColumn(const ScalarColumn& column, uint64_t row_count, v1::PackedArray* array) {
  array->set_data_type(DataTypeOf(column));
  array->add_shape(static_cast<uint32_t>(row_count));
  array->add_shape(3);
}

}  // namespace

uint64_t BytesPerRow(ScalarType scalar, const StateFields& fields) {
  const uint64_t vector_bytes =
      3 * (scalar == ScalarType::kFloat64 ? sizeof(double) : sizeof(float));
  return vector_bytes * (uint64_t{fields.positions} + uint64_t{fields.velocities});
}

uint64_t StateBytes(std::span<const ChunkCloth> cloths, ScalarType scalar,
                    const StateFields& fields) {
  uint64_t rows = 0;
  for (const ChunkCloth& cloth : cloths) rows += cloth.row_count;
  return rows * BytesPerRow(scalar, fields);
}

std::vector<ChunkCloth> ChunkClothsOf(const ClothList& cloths, const StateFields& fields) {
  std::vector<ChunkCloth> chunk_cloths;
  chunk_cloths.reserve(cloths.size());
  for (const auto& cloth : cloths) {
    const uint32_t particles = cloth->description()->model->described_particle_count();
    chunk_cloths.push_back({cloth->id, cloth->placement, fields.RowsOf(particles)});
  }
  return chunk_cloths;
}

StateChunker::StateChunker(std::vector<ChunkCloth> cloths, ClothStates states,
                           uint64_t max_data_bytes)
    : cloths_(std::move(cloths)), states_(std::move(states)) {
  DRAPE_CHECK(cloths_.size() == states_.cloths.size(), "one stamp per cloth");
  const uint64_t row_bytes =
      RowBytes(states_.columns.positions_m) + RowBytes(states_.columns.velocities_m_per_s);
  max_rows_ = row_bytes == 0 ? UINT64_MAX : std::max<uint64_t>(max_data_bytes / row_bytes, 1);
}

void StateChunker::AppendRows(const ChunkCloth& cloth, uint64_t first_row, uint64_t row_count,
                              v1::StateChunk* chunk) const {
  const StateColumns& columns = states_.columns;
  if (RowBytes(columns.positions_m) > 0) {
    const Eigen::Vector3d shift = cloth.placement.WorldFromCloth(Eigen::Vector3d::Zero());
    AppendColumn(columns.positions_m, first_row, row_count, shift, chunk->mutable_positions_m());
  }
  if (RowBytes(columns.velocities_m_per_s) > 0) {
    AppendColumn(columns.velocities_m_per_s, first_row, row_count, Eigen::Vector3d::Zero(),
                 chunk->mutable_velocities_m_per_s());
  }
}

void StateChunker::Next(v1::StateChunk* chunk) {
  DRAPE_CHECK(!is_done_, "no chunk left");
  chunk->Clear();
  const StateColumns& columns = states_.columns;
  if (RowBytes(columns.positions_m) > 0) {
    ReserveRows(columns.positions_m, next_row_, max_rows_, chunk->mutable_positions_m());
  }
  if (RowBytes(columns.velocities_m_per_s) > 0) {
    ReserveRows(columns.velocities_m_per_s, next_row_, max_rows_,
                chunk->mutable_velocities_m_per_s());
  }
  uint64_t rows = 0;
  while (next_cloth_ < cloths_.size() && rows < max_rows_) {
    const ChunkCloth& cloth = cloths_[next_cloth_];
    const ClothStamp& stamp = states_.cloths[next_cloth_];
    // Only a cloth that fits into no chunk is split, and it begins in a chunk of its own.
    if (rows > 0 && cloth.row_count > max_rows_ - rows) break;
    const uint64_t row_count =
        std::min<uint64_t>(cloth.row_count - next_row_of_cloth_, max_rows_ - rows);
    chunk->add_cloth_ids(cloth.id.Packed());
    chunk->add_particle_counts(static_cast<uint32_t>(row_count));
    chunk->add_first_particles(next_row_of_cloth_);
    chunk->add_steps(stamp.completed_steps);
    chunk->add_times_s(stamp.time_s);
    AppendRows(cloth, next_row_, row_count, chunk);
    rows += row_count;
    next_row_ += row_count;
    next_row_of_cloth_ += static_cast<uint32_t>(row_count);
    if (next_row_of_cloth_ == cloth.row_count) {
      ++next_cloth_;
      next_row_of_cloth_ = 0;
    }
  }
  if (chunk->has_positions_m()) {
    FinishColumn(columns.positions_m, rows, chunk->mutable_positions_m());
  }
  if (chunk->has_velocities_m_per_s()) {
    FinishColumn(columns.velocities_m_per_s, rows, chunk->mutable_velocities_m_per_s());
  }
  is_done_ = next_cloth_ == cloths_.size();
  chunk->set_is_last(is_done_);
}

}  // namespace drape::api
