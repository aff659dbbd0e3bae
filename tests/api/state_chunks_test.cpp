#include "server/api/state_chunks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>
#include <optional>

#include "tests/api/parsed_slices.h"

namespace drape::api {
namespace {

using test::NextChunk;

ChunkCloth ClothAt(uint32_t slot, uint32_t row_count,
                   const Eigen::Vector3d& environment_m = Eigen::Vector3d::Zero(),
                   const Eigen::Vector3d& origin_m = Eigen::Vector3d::Zero()) {
  return {ClothId{slot, 1}, {environment_m, origin_m}, row_count, row_count};
}

template <class T>
std::vector<T> ValuesOf(const v1::PackedArray& array) {
  std::vector<T> values(array.data().size() / sizeof(T));
  std::memcpy(values.data(), array.data().data(), array.data().size());
  return values;
}

// Positions 0, 1, 2, ... in one column over all the cloths.
template <class T>
ClothStates CountingStates(std::initializer_list<uint32_t> row_counts, bool with_velocities) {
  ClothStates states;
  uint32_t total = 0;
  for (const uint32_t count : row_counts) {
    states.cloths.push_back(
        {.completed_steps = 10 + count, .time_s = 0.5 * count, .fault = FaultReason::kNone});
    total += count;
  }
  std::vector<T> column(3 * total);
  for (size_t k = 0; k < column.size(); ++k) column[k] = static_cast<T>(k);
  states.columns.positions_m = column;
  states.columns.velocities_m_per_s = with_velocities ? column : std::vector<T>();
  return states;
}

TEST(StateChunks, ShiftsPositionsInDoubleAndLeavesVelocities) {
  ClothStates states = CountingStates<float>({1, 2}, true);
  // 0.1f + 1000 differs when the sum is made in single precision of rounded terms.
  std::get<std::vector<float>>(states.columns.positions_m)[0] = 0.1f;
  StateChunker chunker(
      {ClothAt(4, 1, {1000, 0, 0}, {1e-5, 0, 0}), ClothAt(9, 2, {0, 0, -1}, {0, 2, 0})},
      std::move(states), UINT64_MAX);
  v1::StateChunk chunk = NextChunk(chunker);
  EXPECT_TRUE(chunk.is_last());
  EXPECT_FALSE(chunker.has_next());
  EXPECT_EQ(chunk.positions_m().data_type(), v1::PackedArray::FLOAT32);
  EXPECT_EQ(chunk.positions_m().shape(0), 3u);
  EXPECT_EQ(chunk.positions_m().shape(1), 3u);
  const auto positions = ValuesOf<float>(chunk.positions_m());
  EXPECT_EQ(positions[0], static_cast<float>(double{0.1f} + (1e-5 + 1000)));
  EXPECT_EQ(positions[4], 4.f + 2);
  EXPECT_EQ(positions[8], 8.f - 1);
  EXPECT_EQ(ValuesOf<float>(chunk.velocities_m_per_s()),
            (std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(chunk.cloth_ids(1), (ClothId{9, 1}.Packed()));
  EXPECT_EQ(chunk.particle_counts(1), 2u);
  EXPECT_EQ(chunk.steps(1), 12u);
  EXPECT_EQ(chunk.times_s(1), 1.0);
}

TEST(StateChunks, DoubleStatesStayDouble) {
  StateChunker chunker({ClothAt(0, 1, {0.1, 0, 0})}, CountingStates<double>({1}, false), 100);
  v1::StateChunk chunk = NextChunk(chunker);
  EXPECT_EQ(chunk.positions_m().data_type(), v1::PackedArray::FLOAT64);
  EXPECT_EQ(ValuesOf<double>(chunk.positions_m()), (std::vector<double>{0.1, 1, 2}));
  EXPECT_FALSE(chunk.has_velocities_m_per_s());
}

// With any limit, the chunks together are the whole, and none is above the limit.
TEST(StateChunks, ChunksTogetherAreTheWhole) {
  constexpr uint64_t kRowBytes = 24;  // positions and velocities in float32
  for (uint64_t rows_per_chunk = 1; rows_per_chunk <= 9; ++rows_per_chunk) {
    StateChunker chunker({ClothAt(0, 3), ClothAt(1, 1), ClothAt(2, 4)},
                         CountingStates<float>({3, 1, 4}, true),
                         rows_per_chunk * kRowBytes + kRowBytes - 1);
    std::vector<float> positions;
    std::map<uint64_t, uint32_t> received;
    bool was_last = false;
    while (chunker.has_next()) {
      v1::StateChunk chunk = NextChunk(chunker);
      EXPECT_FALSE(was_last);
      was_last = chunk.is_last();
      EXPECT_LE(chunk.positions_m().data().size() + chunk.velocities_m_per_s().data().size(),
                rows_per_chunk * kRowBytes);
      for (int k = 0; k < chunk.cloth_ids_size(); ++k) {
        EXPECT_EQ(chunk.first_particles(k), received[chunk.cloth_ids(k)]);
        const uint32_t whole = (std::array<uint32_t, 3>{3, 1, 4})[chunk.cloth_ids(k) & 3];
        const bool is_split = chunk.particle_counts(k) < whole;
        EXPECT_EQ(is_split, whole > rows_per_chunk) << "only a cloth that fits into no chunk is";
        received[chunk.cloth_ids(k)] += chunk.particle_counts(k);
      }
      const auto part = ValuesOf<float>(chunk.positions_m());
      positions.insert(positions.end(), part.begin(), part.end());
    }
    EXPECT_TRUE(was_last);
    ASSERT_EQ(positions.size(), 24u);
    for (size_t k = 0; k < positions.size(); ++k) EXPECT_EQ(positions[k], static_cast<float>(k));
    EXPECT_EQ(received[(ClothId{2, 1}.Packed())], 4u);
  }
}

// What is not encoded is sent from where the backend has put it; a chunk may outlive the others.
TEST(StateChunks, ChunksShareTheColumn) {
  ClothStates states = CountingStates<float>({3, 1, 4}, false);
  const auto* const column = std::get<std::vector<float>>(states.columns.positions_m).data();
  std::optional<StateChunker> chunker(
      std::in_place,
      std::vector<ChunkCloth>{ClothAt(0, 3), ClothAt(1, 1, {0, 1, 0}), ClothAt(2, 4)},
      std::move(states), 4 * 12);
  const MessageSlices first = chunker->Next(), second = chunker->Next();
  chunker.reset();
  const auto data_of = [](const MessageSlices& chunk) {
    return reinterpret_cast<const float*>(chunk.back().begin());
  };
  EXPECT_EQ(data_of(first), column);
  EXPECT_EQ(data_of(second), column + 4 * 3);
  const auto positions = ValuesOf<float>(test::Parsed<v1::StateChunk>(first).positions_m());
  EXPECT_EQ(positions, (std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 11}));
  EXPECT_EQ(test::Parsed<v1::StateChunk>(second).positions_m().data().size(), 4 * 12u);
}

TEST(StateChunks, NoClothsIsOneEmptyChunk) {
  StateChunker chunker({}, {}, 1 << 20);
  ASSERT_TRUE(chunker.has_next());
  v1::StateChunk chunk = NextChunk(chunker);
  EXPECT_TRUE(chunk.is_last());
  EXPECT_EQ(chunk.cloth_ids_size(), 0);
  EXPECT_FALSE(chunk.has_positions_m());
}

TEST(StateChunks, BytesReadAndSent) {
  const std::vector<ChunkCloth> cloths = {ClothAt(0, 3), ClothAt(1, 5)};
  ViewSpec view{.fields = {.positions = true}};
  EXPECT_EQ(BytesRead(cloths, ScalarType::kFloat32, view), 8 * 12u);
  EXPECT_EQ(BytesSent(cloths, ScalarType::kFloat32, view), 8 * 12u);
  view.fields.velocities = true;
  EXPECT_EQ(BytesRead(cloths, ScalarType::kFloat64, view), 8 * 48u);
  view.encoding = v1::StateView::FIXED16;
  EXPECT_EQ(BytesRead(cloths, ScalarType::kFloat64, view), 8 * 48u);
  EXPECT_EQ(BytesSent(cloths, ScalarType::kFloat64, view), 8 * 12u);
  view = {.fields = {}, .reductions = {.centroid = true}};
  EXPECT_EQ(BytesRead(cloths, ScalarType::kFloat32, view), 8 * 12u);
}

// Chunks of some rows of an encoded view with reductions hold what one whole chunk does.
TEST(StateChunks, EncodedPartsAreTheWhole) {
  ViewSpec view{.fields = {.positions = true, .velocities = true, .particles = {0, 2, 3, 5, 6}},
                .encoding = v1::StateView::FIXED16,
                .reductions = {.centroid = true}};
  const auto chunker_of = [&](uint64_t max_bytes) {
    std::vector<ChunkCloth> cloths = {ClothAt(0, 7), ClothAt(1, 9, {5, 0, 0}, {0, 0, 3})};
    for (ChunkCloth& cloth : cloths) cloth.row_count = 5;
    return StateChunker(cloths, CountingStates<float>({7, 9}, true), max_bytes, view);
  };
  StateChunker in_one = chunker_of(UINT64_MAX);
  const v1::StateChunk whole = NextChunk(in_one);
  EXPECT_EQ(whole.positions_m().data_type(), v1::PackedArray::INT16);
  EXPECT_EQ(whole.velocities_m_per_s().data_type(), v1::PackedArray::FLOAT16);
  EXPECT_EQ(whole.positions_m().shape(0), 10u);
  ASSERT_EQ(whole.position_steps_m_size(), 2);
  EXPECT_DOUBLE_EQ(whole.position_steps_m(0), 18 / 65534.0) << "particles 0 to 6 are 18 m apart";
  // Of all particles, not of the rows that are sent.
  EXPECT_THAT(whole.centroids_m(), testing::ElementsAre(9, 10, 11, 33 + 5, 34, 35 + 3));
  const auto numbers = ValuesOf<int16_t>(whole.positions_m());
  EXPECT_EQ(numbers.front(), -32767);
  std::string positions, velocities;
  StateChunker parts = chunker_of(3 * 12);
  int chunks = 0;
  for (; parts.has_next(); ++chunks) {
    const v1::StateChunk chunk = NextChunk(parts);
    positions += chunk.positions_m().data();
    velocities += chunk.velocities_m_per_s().data();
    for (int k = 0; k < chunk.cloth_ids_size(); ++k) {
      const int cloth = chunk.cloth_ids(k) == whole.cloth_ids(0) ? 0 : 1;
      EXPECT_EQ(chunk.position_steps_m(k), whole.position_steps_m(cloth));
      EXPECT_EQ(chunk.origins_m(3 * k), whole.origins_m(3 * cloth));
      EXPECT_EQ(chunk.centroids_m(3 * k), whole.centroids_m(3 * cloth));
    }
  }
  EXPECT_GT(chunks, 3);
  EXPECT_EQ(positions, whole.positions_m().data());
  EXPECT_EQ(velocities, whole.velocities_m_per_s().data());
}

TEST(StateChunks, ReductionsAloneHaveNoRows) {
  const ViewSpec view{.fields = {}, .reductions = {.box = true}};
  std::vector<ChunkCloth> cloths = {ClothAt(0, 7), ClothAt(1, 2), ClothAt(2, 3)};
  for (ChunkCloth& cloth : cloths) cloth.row_count = 0;
  StateChunker chunker(cloths, CountingStates<double>({7, 2, 3}, false), 256, view);
  v1::StateChunk chunk = NextChunk(chunker);
  EXPECT_EQ(chunk.cloth_ids_size(), 2) << "a chunk is no larger than asked for";
  EXPECT_FALSE(chunk.has_positions_m());
  EXPECT_THAT(chunk.boxes_m(), testing::ElementsAre(0, 1, 2, 18, 19, 20, 21, 22, 23, 24, 25, 26));
  chunk = NextChunk(chunker);
  EXPECT_THAT(chunk.boxes_m(), testing::ElementsAre(27, 28, 29, 33, 34, 35));
  EXPECT_TRUE(chunk.is_last());
}

}  // namespace
}  // namespace drape::api
