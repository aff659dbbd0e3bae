#include "server/api/state_chunks.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/core/check.h"
#include "server/core/trace.h"

namespace drape::api {
namespace {

// About what the reductions of a cloth take [bytes].
constexpr uint64_t kReductionBytes = 128;

v1::PackedArray::DataType DataTypeOf(const ScalarColumn& column) {
  return std::holds_alternative<std::vector<double>>(column) ? v1::PackedArray::FLOAT64
                                                             : v1::PackedArray::FLOAT32;
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

// A PackedArray of `row_count` rows of three numbers in a field of the message.
void WriteArray(int field, v1::PackedArray::DataType type, uint64_t row_count, grpc::Slice data,
                MessageWriter& writer) {
  constexpr int kData = v1::PackedArray::kDataFieldNumber;
  v1::PackedArray array;  // without its data
  array.set_data_type(type);
  array.add_shape(static_cast<uint32_t>(row_count));
  array.add_shape(3);
  writer.BeginField(field, array.ByteSizeLong() + MessageWriter::FieldBytes(kData, data.size()));
  writer.AppendFields(array);
  writer.BeginField(kData, data.size());
  writer.Append(std::move(data));
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
      stamps_(std::move(states.cloths)),
      encoding_(view.encoding),
      reduction_spec_(view.reductions) {
  DRAPE_CHECK(cloths_.size() == stamps_.size(), "one stamp per cloth");
  if (reduction_spec_.any()) ReduceStates(view, states.columns);
  positions_m_ = SentColumn(std::move(states.columns.positions_m));
  velocities_m_per_s_ = SentColumn(std::move(states.columns.velocities_m_per_s));
  const auto row_bytes_of = [&](const SentColumn& column) {
    return column.row_count() == 0 ? 0 : 3 * EncodedBytes(encoding_, column.numbers());
  };
  const uint64_t row_bytes = row_bytes_of(positions_m_) + row_bytes_of(velocities_m_per_s_);
  max_rows_ = row_bytes == 0 ? UINT64_MAX : std::max<uint64_t>(max_data_bytes / row_bytes, 1);
  max_cloths_ =
      reductions_.empty() ? UINT64_MAX : std::max<uint64_t>(max_data_bytes / kReductionBytes, 1);
}

void StateChunker::ReduceStates(const ViewSpec& view, StateColumns& columns) {
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

void StateChunker::AddPositions(const ChunkCloth& cloth, uint64_t row_count, Chunk& chunk) {
  const Placement& placement = cloth.placement;
  if (encoding_ == v1::StateView::FLOAT16) {
    AppendVector(placement.environment_origin_m, chunk.fields.mutable_origins_m());
    AppendFloat16(positions_m_.numbers(), next_row_, row_count, placement.origin_in_environment_m,
                  &chunk.positions);
  } else if (encoding_ == v1::StateView::FIXED16) {
    if (next_row_of_cloth_ == 0) {
      grid_ = FixedGridOf(positions_m_.numbers(), next_row_, cloth.row_count);
    }
    AppendVector(placement.WorldFromCloth(grid_.middle_m), chunk.fields.mutable_origins_m());
    chunk.fields.add_position_steps_m(grid_.step_m);
    AppendFixed16(positions_m_.numbers(), next_row_, row_count, grid_, &chunk.positions);
  } else {
    positions_m_.Shift(next_row_, row_count, placement.WorldFromCloth(Eigen::Vector3d::Zero()));
  }
}

void StateChunker::AddVelocities(uint64_t row_count, Chunk& chunk) const {
  if (!is_encoded()) return;
  AppendFloat16(velocities_m_per_s_.numbers(), next_row_, row_count, Eigen::Vector3d::Zero(),
                &chunk.velocities);
}

void StateChunker::AddReductions(const Reductions& reductions, v1::StateChunk* fields) const {
  if (reduction_spec_.coverage) fields->add_coverages_m2(reductions.coverage_m2);
  if (reduction_spec_.centroid) AppendVector(reductions.centroid_m, fields->mutable_centroids_m());
  if (reduction_spec_.box) {
    AppendVector(reductions.box_m.min(), fields->mutable_boxes_m());
    AppendVector(reductions.box_m.max(), fields->mutable_boxes_m());
  }
  if (reduction_spec_.target_distance) {
    fields->add_target_distances_m(reductions.target_distance_m);
  }
}

// The next `row_count` rows, which are rows of this cloth, the next one.
void StateChunker::AddCloth(const ChunkCloth& cloth, uint64_t row_count, Chunk& chunk) {
  const ClothStamp& stamp = stamps_[next_cloth_];
  chunk.fields.add_cloth_ids(cloth.id.Packed());
  chunk.fields.add_particle_counts(static_cast<uint32_t>(row_count));
  chunk.fields.add_first_particles(next_row_of_cloth_);
  chunk.fields.add_steps(stamp.completed_steps);
  chunk.fields.add_times_s(stamp.time_s);
  if (!reductions_.empty()) AddReductions(reductions_[next_cloth_], &chunk.fields);
  if (positions_m_.row_count() > 0) AddPositions(cloth, row_count, chunk);
  if (velocities_m_per_s_.row_count() > 0) AddVelocities(row_count, chunk);
}

uint64_t StateChunker::AddCloths(Chunk& chunk) {
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
  return rows;
}

MessageSlices StateChunker::Next() {
  const trace::Span span("encode_states");
  DRAPE_CHECK(!is_done_, "no chunk left");
  Chunk chunk;
  const uint64_t first_row = next_row_;
  const uint64_t row_count = AddCloths(chunk);
  is_done_ = next_cloth_ == cloths_.size();
  chunk.fields.set_is_last(is_done_);
  MessageWriter writer;
  writer.AppendFields(chunk.fields);
  const auto write = [&](int field, const SentColumn& column, v1::PackedArray::DataType type,
                         std::string& encoded) {
    if (column.row_count() == 0) return;
    if (is_encoded())
      return WriteArray(field, type, row_count, SliceOf(std::move(encoded)), writer);
    WriteArray(field, DataTypeOf(column.numbers()), row_count, column.Rows(first_row, row_count),
               writer);
  };
  write(v1::StateChunk::kPositionsMFieldNumber, positions_m_,
        encoding_ == v1::StateView::FLOAT16 ? v1::PackedArray::FLOAT16 : v1::PackedArray::INT16,
        chunk.positions);
  write(v1::StateChunk::kVelocitiesMPerSFieldNumber, velocities_m_per_s_, v1::PackedArray::FLOAT16,
        chunk.velocities);
  return std::move(writer).Finish();
}

}  // namespace drape::api
