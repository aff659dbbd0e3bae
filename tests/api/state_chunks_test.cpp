#include "server/api/state_chunks.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>

namespace drape::api {
namespace {

ChunkCloth ClothAt(uint32_t slot, uint32_t row_count,
                   const Eigen::Vector3d& environment_m = Eigen::Vector3d::Zero(),
                   const Eigen::Vector3d& origin_m = Eigen::Vector3d::Zero()) {
  return {ClothId{slot, 1}, {environment_m, origin_m}, row_count};
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
  v1::StateChunk chunk;
  chunker.Next(&chunk);
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
  v1::StateChunk chunk;
  chunker.Next(&chunk);
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
      v1::StateChunk chunk;
      chunker.Next(&chunk);
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

TEST(StateChunks, NoClothsIsOneEmptyChunk) {
  StateChunker chunker({}, {}, 1 << 20);
  ASSERT_TRUE(chunker.has_next());
  v1::StateChunk chunk;
  chunker.Next(&chunk);
  EXPECT_TRUE(chunk.is_last());
  EXPECT_EQ(chunk.cloth_ids_size(), 0);
  EXPECT_FALSE(chunk.has_positions_m());
}

TEST(StateChunks, BytesPerRow) {
  EXPECT_EQ(BytesPerRow(ScalarType::kFloat32, {true, false}), 12u);
  EXPECT_EQ(BytesPerRow(ScalarType::kFloat64, {true, true}), 48u);
  EXPECT_EQ(BytesPerRow(ScalarType::kFloat32, {false, false}), 0u);
}

}  // namespace
}  // namespace drape::api
