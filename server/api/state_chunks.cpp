#include "server/api/state_chunks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "server/core/check.h"
#include "server/core/trace.h"

namespace drape::api {
namespace {

// About what the reductions of a cloth take [bytes].
constexpr uint64_t kReductionBytes = 128;

bool IsEmpty(const ScalarColumn& column) {
  return std::visit([](const auto& values) { return values.empty(); }, column);
}

uint64_t RowBytes(v1::StateView::Encoding encoding, const ScalarColumn& column) {
  return IsEmpty(column) ? 0 : 3 * EncodedBytes(encoding, column);
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

void AppendColumn(const ScalarColumn& column, uint64_t first_row, uint64_t row_count,
                  const Eigen::Vector3d& shift, v1::PackedArray* array) {
  std::visit(
      [&](const auto& values) {
        AppendShifted(values.data() + 3 * first_row, row_count, shift, array->mutable_data());
      },
      column);
}

void FinishColumn(v1::PackedArray::DataType type, uint64_t row_count, v1::PackedArray* array) {
  array->set_data_type(type);
  array->add_shape(static_cast<uint32_t>(row_count));
  array->add_shape(3);
}

void AppendVector(const Eigen::Vector3d& vector, google::protobuf::RepeatedField<double>* numbers) {
  numbers->Add(vector.begin(), vector.end());
}

// Of whole cloths, the rows of `particles`.
ScalarColumn PickRows(const ScalarColumn& column, std::span<const ChunkCloth> cloths,
                      std::span<const uint32_t> particles) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        std::decay_t<decltype(values)> picked;
        if (values.empty()) return picked;
        picked.reserve(3 * cloths.size() * particles.size());
        auto first = values.begin();
        for (const ChunkCloth& cloth : cloths) {
          for (const uint32_t particle : particles) {
            picked.insert(picked.end(), first + 3 * particle, first + 3 * particle + 3);
          }
          first += 3 * ptrdiff_t{cloth.rows_read};
        }
        return picked;
      },
      column);
}

uint64_t ColumnsOf(const StateFields& fields) {
  return uint64_t{fields.positions} + uint64_t{fields.velocities};
}

}  // namespace

uint64_t BytesRead(std::span<const ChunkCloth> cloths, ScalarType scalar, const ViewSpec& view) {
  uint64_t rows = 0;
  for (const ChunkCloth& cloth : cloths) rows += cloth.rows_read;
  return rows * 3 * EncodedBytes(v1::StateView::ENCODING_UNSPECIFIED, scalar) *
         ColumnsOf(view.FieldsRead());
}

uint64_t BytesSent(std::span<const ChunkCloth> cloths, ScalarType scalar, const ViewSpec& view) {
  uint64_t rows = 0;
  for (const ChunkCloth& cloth : cloths) rows += cloth.row_count;
  return rows * 3 * EncodedBytes(view.encoding, scalar) * ColumnsOf(view.fields) +
         (view.reductions.any() ? cloths.size() * kReductionBytes : 0);
}

std::vector<ChunkCloth> ChunkClothsOf(const ClothList& cloths, const ViewSpec& view) {
  const StateFields read = view.FieldsRead();
  std::vector<ChunkCloth> chunk_cloths;
  chunk_cloths.reserve(cloths.size());
  for (const auto& cloth : cloths) {
    const uint32_t particles = cloth->description()->model->described_particle_count();
    chunk_cloths.push_back({cloth->id, cloth->placement,
                            view.fields.any() ? view.fields.RowsOf(particles) : 0,
                            read.RowsOf(particles)});
  }
  return chunk_cloths;
}

StateChunker::StateChunker(std::vector<ChunkCloth> cloths, ClothStates states,
                           uint64_t max_data_bytes, const ViewSpec& view)
    : cloths_(std::move(cloths)),
      states_(std::move(states)),
      encoding_(view.encoding),
      reduction_spec_(view.reductions) {
  DRAPE_CHECK(cloths_.size() == states_.cloths.size(), "one stamp per cloth");
  if (reduction_spec_.any()) ReduceStates(view);
  const uint64_t row_bytes = RowBytes(encoding_, states_.columns.positions_m) +
                             RowBytes(encoding_, states_.columns.velocities_m_per_s);
  max_rows_ = row_bytes == 0 ? UINT64_MAX : std::max<uint64_t>(max_data_bytes / row_bytes, 1);
  max_cloths_ =
      reductions_.empty() ? UINT64_MAX : std::max<uint64_t>(max_data_bytes / kReductionBytes, 1);
}

void StateChunker::ReduceStates(const ViewSpec& view) {
  StateColumns& columns = states_.columns;
  uint64_t row = 0;
  reductions_.reserve(cloths_.size());
  for (const ChunkCloth& cloth : cloths_) {
    reductions_.push_back(
        Reduce(reduction_spec_, columns.positions_m, row, cloth.rows_read, cloth.placement));
    row += cloth.rows_read;
  }
  if (!view.fields.positions) columns.positions_m = {};
  if (view.fields.particles.empty()) return;
  columns.positions_m = PickRows(columns.positions_m, cloths_, view.fields.particles);
  columns.velocities_m_per_s = PickRows(columns.velocities_m_per_s, cloths_, view.fields.particles);
}

// Reserves what a chunk that begins at the next row can hold: growing it step by step would copy
// it.
void StateChunker::Reserve(v1::StateChunk* chunk) const {
  const auto reserve = [&](const ScalarColumn& column, auto array) {
    if (IsEmpty(column)) return;
    const uint64_t rows = std::visit([](const auto& values) { return values.size() / 3; }, column);
    array()->mutable_data()->reserve(std::min(rows - next_row_, max_rows_) *
                                     RowBytes(encoding_, column));
  };
  reserve(states_.columns.positions_m, [&] { return chunk->mutable_positions_m(); });
  reserve(states_.columns.velocities_m_per_s, [&] { return chunk->mutable_velocities_m_per_s(); });
}

void StateChunker::AppendPositions(const ChunkCloth& cloth, uint64_t row_count,
                                   v1::StateChunk* chunk) const {
  const ScalarColumn& column = states_.columns.positions_m;
  const Placement& placement = cloth.placement;
  v1::PackedArray* array = chunk->mutable_positions_m();
  if (encoding_ == v1::StateView::FLOAT16) {
    AppendVector(placement.environment_origin_m, chunk->mutable_origins_m());
    AppendFloat16(column, next_row_, row_count, placement.origin_in_environment_m,
                  array->mutable_data());
  } else if (encoding_ == v1::StateView::FIXED16) {
    AppendVector(placement.WorldFromCloth(grid_.middle_m), chunk->mutable_origins_m());
    chunk->add_position_steps_m(grid_.step_m);
    AppendFixed16(column, next_row_, row_count, grid_, array->mutable_data());
  } else {
    AppendColumn(column, next_row_, row_count, placement.WorldFromCloth(Eigen::Vector3d::Zero()),
                 array);
  }
}

void StateChunker::AppendVelocities(uint64_t row_count, v1::StateChunk* chunk) const {
  const ScalarColumn& column = states_.columns.velocities_m_per_s;
  v1::PackedArray* array = chunk->mutable_velocities_m_per_s();
  if (encoding_ == v1::StateView::ENCODING_UNSPECIFIED) {
    AppendColumn(column, next_row_, row_count, Eigen::Vector3d::Zero(), array);
  } else {
    AppendFloat16(column, next_row_, row_count, Eigen::Vector3d::Zero(), array->mutable_data());
  }
}

void StateChunker::AddReductions(const Reductions& reductions, v1::StateChunk* chunk) const {
  if (reduction_spec_.coverage) chunk->add_coverages_m2(reductions.coverage_m2);
  if (reduction_spec_.centroid) AppendVector(reductions.centroid_m, chunk->mutable_centroids_m());
  if (reduction_spec_.box) {
    AppendVector(reductions.box_m.min(), chunk->mutable_boxes_m());
    AppendVector(reductions.box_m.max(), chunk->mutable_boxes_m());
  }
  if (reduction_spec_.target_distance) {
    chunk->add_target_distances_m(reductions.target_distance_m);
  }
}

// The next `row_count` rows, which are rows of this cloth, the next one.
void StateChunker::AddCloth(const ChunkCloth& cloth, uint64_t row_count, v1::StateChunk* chunk) {
  const ClothStamp& stamp = states_.cloths[next_cloth_];
  chunk->add_cloth_ids(cloth.id.Packed());
  chunk->add_particle_counts(static_cast<uint32_t>(row_count));
  chunk->add_first_particles(next_row_of_cloth_);
  chunk->add_steps(stamp.completed_steps);
  chunk->add_times_s(stamp.time_s);
  if (!reductions_.empty()) AddReductions(reductions_[next_cloth_], chunk);
  if (!IsEmpty(states_.columns.positions_m)) {
    if (encoding_ == v1::StateView::FIXED16 && next_row_of_cloth_ == 0) {
      grid_ = FixedGridOf(states_.columns.positions_m, next_row_, cloth.row_count);
    }
    AppendPositions(cloth, row_count, chunk);
  }
  if (!IsEmpty(states_.columns.velocities_m_per_s)) AppendVelocities(row_count, chunk);
}

void StateChunker::Next(v1::StateChunk* chunk) {
  const trace::Span span("encode_states");
  DRAPE_CHECK(!is_done_, "no chunk left");
  chunk->Clear();
  Reserve(chunk);
  uint64_t rows = 0, cloths = 0;
  while (next_cloth_ < cloths_.size() && rows < max_rows_ && cloths < max_cloths_) {
    const ChunkCloth& cloth = cloths_[next_cloth_];
    // Only a cloth that fits into no chunk is split, and it begins in a chunk of its own.
    if (rows > 0 && cloth.row_count > max_rows_ - rows) break;
    const uint64_t row_count =
        std::min<uint64_t>(cloth.row_count - next_row_of_cloth_, max_rows_ - rows);
    AddCloth(cloth, row_count, chunk);
    ++cloths;
    rows += row_count;
    next_row_ += row_count;
    next_row_of_cloth_ += static_cast<uint32_t>(row_count);
    if (next_row_of_cloth_ == cloth.row_count) {
      ++next_cloth_;
      next_row_of_cloth_ = 0;
    }
  }
  const bool is_encoded = encoding_ != v1::StateView::ENCODING_UNSPECIFIED;
  if (chunk->has_positions_m()) {
    FinishColumn(!is_encoded                           ? DataTypeOf(states_.columns.positions_m)
                 : encoding_ == v1::StateView::FLOAT16 ? v1::PackedArray::FLOAT16
                                                       : v1::PackedArray::INT16,
                 rows, chunk->mutable_positions_m());
  }
  if (chunk->has_velocities_m_per_s()) {
    FinishColumn(
        is_encoded ? v1::PackedArray::FLOAT16 : DataTypeOf(states_.columns.velocities_m_per_s),
        rows, chunk->mutable_velocities_m_per_s());
  }
  is_done_ = next_cloth_ == cloths_.size();
  chunk->set_is_last(is_done_);
}

}  // namespace drape::api
