#include "drape/states.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "client/src/state_decoding.h"

namespace drape {
inline namespace client {
namespace {

// Messages are little-endian, and the views read their bytes directly.
static_assert(std::endian::native == std::endian::little);

// Throws unless the array is absent, or holds [row_count, 3] floating point elements.
void CheckArray(const v1::PackedArray& array, uint64_t row_count, const char* name) {
  if (array.data().empty() && array.shape().empty()) return;
  const bool is_float64 = array.data_type() == v1::PackedArray::FLOAT64;
  if (!is_float64 && array.data_type() != v1::PackedArray::FLOAT32) {
    throw MalformedStates(std::string("with an unknown data type in ") + name);
  }
  if (array.shape_size() != 2 || array.shape(0) != row_count || array.shape(1) != 3 ||
      array.data().size() != row_count * 3 * (is_float64 ? sizeof(double) : sizeof(float))) {
    throw MalformedStates(std::string("whose shape does not fit the particle counts: ") + name);
  }
}

template <class Element>
VectorView Rows(const v1::PackedArray& array, size_t first_row, size_t row_count) {
  const auto* elements = reinterpret_cast<const Element*>(array.data().data());
  return VectorView(std::span<const Element>(elements + 3 * first_row, 3 * row_count));
}

VectorView View(const v1::PackedArray& array, size_t first_row, size_t row_count) {
  if (array.data().empty() || row_count == 0) return {};
  return array.data_type() == v1::PackedArray::FLOAT64 ? Rows<double>(array, first_row, row_count)
                                                       : Rows<float>(array, first_row, row_count);
}

void AppendArray(const v1::PackedArray& more, v1::PackedArray* array) {
  if (more.shape().empty()) return;
  if (array->shape_size() != 2 || array->data_type() != more.data_type()) {
    throw MalformedStates("whose chunks differ in their fields");
  }
  array->mutable_data()->append(more.data());
  array->set_shape(0, array->shape(0) + more.shape(0));
}

// Appends a chunk that continues the first cloth of `chunk`.
void AppendContinued(const v1::StateChunk& more, v1::StateChunk* chunk) {
  const int last = chunk->cloth_ids_size() - 1;
  if (last < 0 || more.cloth_ids(0) != chunk->cloth_ids(last) ||
      more.particle_counts_size() != more.cloth_ids_size()) {
    throw MalformedStates("that continue a cloth which no chunk began");
  }
  chunk->set_particle_counts(last, chunk->particle_counts(last) + more.particle_counts(0));
  for (int k = 1; k < more.cloth_ids_size(); ++k) {
    chunk->add_cloth_ids(more.cloth_ids(k));
    chunk->add_particle_counts(more.particle_counts(k));
  }
  const auto append_rest = [](const auto& from, auto* to, int width = 1) {
    for (int k = width; k < from.size(); ++k) to->Add(from[k]);
  };
  append_rest(more.steps(), chunk->mutable_steps());
  append_rest(more.times_s(), chunk->mutable_times_s());
  append_rest(more.coverages_m2(), chunk->mutable_coverages_m2());
  append_rest(more.centroids_m(), chunk->mutable_centroids_m(), 3);
  append_rest(more.boxes_m(), chunk->mutable_boxes_m(), 6);
  append_rest(more.target_distances_m(), chunk->mutable_target_distances_m());
  AppendArray(more.positions_m(), chunk->mutable_positions_m());
  AppendArray(more.velocities_m_per_s(), chunk->mutable_velocities_m_per_s());
  chunk->set_frames_dropped(chunk->frames_dropped() + more.frames_dropped());
}

// A cloth too large for one chunk arrives in several: those become one, so that each cloth is one
// view.
std::vector<v1::StateChunk> JoinContinued(std::vector<v1::StateChunk> chunks) {
  std::vector<v1::StateChunk> joined;
  for (v1::StateChunk& chunk : chunks) {
    DecodeStates(&chunk);
    const bool is_continued = chunk.first_particles_size() > 0 && chunk.first_particles(0) > 0;
    if (is_continued && chunk.cloth_ids_size() > 0) {
      if (joined.empty()) throw MalformedStates("that begin in the middle of a cloth");
      AppendContinued(chunk, &joined.back());
    } else {
      joined.push_back(std::move(chunk));
    }
  }
  return joined;
}

// The numbers of cloth `index`, if there are `Width` for each of `cloth_count` cloths.
template <size_t Width>
std::optional<std::array<double, Width>> ReductionOf(
    const google::protobuf::RepeatedField<double>& values, int index, int cloth_count) {
  if (values.empty()) return {};
  constexpr int kWidth = Width;
  if (values.size() != kWidth * cloth_count)
    throw MalformedStates("whose reductions differ in length");
  std::array<double, Width> numbers;
  std::copy_n(values.begin() + ptrdiff_t{kWidth} * index, Width, numbers.begin());
  return numbers;
}

// The first number, if there is any.
std::optional<double> NumberOf(const std::optional<std::array<double, 1>>& numbers) {
  return numbers ? std::optional(numbers->front()) : std::nullopt;
}

}  // namespace

States::States(std::vector<v1::StateChunk> chunks) : chunks_(JoinContinued(std::move(chunks))) {
  for (const v1::StateChunk& chunk : chunks_) AddChunk(chunk);
}

void States::AddChunk(const v1::StateChunk& chunk) {
  const int cloth_count = chunk.cloth_ids_size();
  if (chunk.particle_counts_size() != cloth_count || chunk.steps_size() != cloth_count ||
      chunk.times_s_size() != cloth_count) {
    throw MalformedStates("whose columns differ in length");
  }
  uint64_t row_count = 0;
  for (const uint32_t count : chunk.particle_counts()) row_count += count;
  CheckArray(chunk.positions_m(), row_count, "positions_m");
  CheckArray(chunk.velocities_m_per_s(), row_count, "velocities_m_per_s");

  size_t first_row = 0;
  for (int k = 0; k < cloth_count; ++k) {
    ClothState cloth;
    cloth.cloth_id = chunk.cloth_ids(k);
    cloth.step = chunk.steps(k);
    cloth.time_s = chunk.times_s(k);
    cloth.particle_count = chunk.particle_counts(k);
    cloth.positions_m = View(chunk.positions_m(), first_row, cloth.particle_count);
    cloth.velocities_m_per_s = View(chunk.velocities_m_per_s(), first_row, cloth.particle_count);
    cloth.coverage_m2 = NumberOf(ReductionOf<1>(chunk.coverages_m2(), k, cloth_count));
    cloth.centroid_m = ReductionOf<3>(chunk.centroids_m(), k, cloth_count);
    cloth.box_m = ReductionOf<6>(chunk.boxes_m(), k, cloth_count);
    cloth.target_distance_m = NumberOf(ReductionOf<1>(chunk.target_distances_m(), k, cloth_count));
    first_row += cloth.particle_count;
    cloths_.push_back(cloth);
  }
  if (chunk.frame() != 0) frame_ = chunk.frame();
  frames_dropped_ += chunk.frames_dropped();
}

}  // namespace client
}  // namespace drape
