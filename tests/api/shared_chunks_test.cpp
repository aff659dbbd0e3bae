#include "server/api/shared_chunks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "tests/api/parsed_slices.h"

namespace drape::api {
namespace {

constexpr uint32_t kChunkRows = 100;
constexpr uint64_t kChunkRowBytes = 12;

StateChunker Chunker() {
  ClothStates states;
  states.cloths.push_back({.completed_steps = 7, .time_s = 0.5, .fault = FaultReason::kNone});
  std::vector<float> column(3 * kChunkRows);
  for (size_t k = 0; k < column.size(); ++k) column[k] = static_cast<float>(k);
  states.columns.positions_m = column;
  states.columns.velocities_m_per_s = std::vector<float>();
  return {{{ClothId{1, 1}, {}, kChunkRows, kChunkRows}}, std::move(states), 10 * kChunkRowBytes};
}

std::vector<std::string> ReadAll(SharedChunks chunks) {
  std::vector<std::string> all;
  while (chunks.has_next()) all.push_back(test::Joined(chunks.Next()));
  return all;
}

TEST(SharedChunks, EachCopyGetsWhatTheChunkerMakesAndItIsMadeOnce) {
  int encodings = 0;
  const SharedChunks first(Chunker(), [&] { ++encodings; });
  EXPECT_EQ(encodings, 0) << "nobody wanted a chunk";
  StateChunker chunker = Chunker();
  std::vector<std::string> expected;
  while (chunker.has_next()) expected.push_back(test::Joined(chunker.Next()));
  ASSERT_EQ(expected.size(), 10u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(ReadAll(first), expected);
  EXPECT_EQ(encodings, 1);
}

TEST(SharedChunks, ACopyGetsTheSameBytesNotEqualOnes) {
  SharedChunks one(Chunker(), [] {}), other = one;
  const MessageSlices a = one.Next(), b = other.Next();
  ASSERT_EQ(a.size(), b.size());
  for (size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].begin(), b[k].begin());
}

TEST(SharedChunks, CopiesGoOnFromWhereTheOriginalIs) {
  SharedChunks one(Chunker(), [] {});
  one.Next();
  EXPECT_EQ(ReadAll(one).size(), 9u);
  EXPECT_EQ(ReadAll(one).size(), 9u);
}

TEST(SharedChunks, ManyThreadsShareOneEncoding) {
  std::atomic<int> encodings = 0;
  const SharedChunks first(Chunker(), [&] { ++encodings; });
  const std::vector<std::string> expected = ReadAll(SharedChunks(Chunker(), [] {}));
  std::vector<std::vector<std::string>> found(4);
  std::vector<std::thread> threads;
  for (auto& chunks : found) threads.emplace_back([&] { chunks = ReadAll(first); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& chunks : found) EXPECT_EQ(chunks, expected);
  EXPECT_EQ(encodings, 1);
}

}  // namespace
}  // namespace drape::api
