// DeviceArena, MirroredBuffer, MirroredArena, ModelStore, MapStore and StateReader on a device.
#include "server/solver/gl_compute/device_arrays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <numeric>

#include "server/gl/context.h"
#include "server/solver/gl_compute/device_map.h"
#include "server/solver/gl_compute/device_model.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/state_reader.h"
#include "shaders/interface/bindings.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/solids/solids.h"

namespace drape {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr int64_t kLargeBytes = 1 << 24;

class DeviceArraysTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

  static std::vector<uint32_t> Download(const gl::Buffer& buffer, const WordRange& range) {
    std::vector<uint32_t> words(range.count());
    buffer.Download(4 * uint64_t{range.begin()}, std::as_writable_bytes(std::span(words)));
    return words;
  }

 private:
  std::unique_ptr<gl::Context> context_;
};

TEST_F(DeviceArraysTest, ArenaGrowsWithItsContents) {
  Result<DeviceArena> arena = DeviceArena::Create("test", kLargeBytes);
  ASSERT_TRUE(arena.ok());
  const uint64_t first_capacity = arena->capacity_words();
  std::vector<WordRange> ranges;
  for (uint32_t k = 0; k < 50; ++k) {
    Result<WordRange> range = arena->Allocate(1000);
    ASSERT_TRUE(range.ok());
    ranges.push_back(std::move(range).value());
    const std::vector<uint32_t> words(1000, k);
    arena->Write(ranges.back(), 0, std::span(words));
  }
  EXPECT_GT(arena->capacity_words(), first_capacity);
  for (uint32_t k = 0; k < 50; ++k) {
    EXPECT_EQ(Download(arena->buffer(), ranges[k]), std::vector<uint32_t>(1000, k));
  }
}

TEST_F(DeviceArraysTest, ArenaRefusesBeyondItsLimitAndReusesRoom) {
  Result<DeviceArena> arena = DeviceArena::Create("test", 4096);
  ASSERT_TRUE(arena.ok());
  Result<WordRange> half = arena->Allocate(512);
  ASSERT_TRUE(half.ok());
  const Result<WordRange> too_much = arena->Allocate(513);
  ASSERT_FALSE(too_much.ok());
  EXPECT_EQ(too_much.status().reason(), "DEVICE_MEMORY");
  EXPECT_THAT(too_much.status().message(), HasSubstr("\"test\""));
  EXPECT_EQ(arena->free_words(), 512u);
  { const WordRange gone = std::move(half).value(); }
  EXPECT_TRUE(arena->Allocate(1024).ok());
  EXPECT_TRUE(arena->Allocate(0).ok());
}

// The next owner of words does not get what the former one had there.
TEST_F(DeviceArraysTest, ReusedRangesAreZeros) {
  Result<DeviceArena> arena = DeviceArena::Create("test", kLargeBytes);
  Result<MirroredArena> mirrored = MirroredArena::Create("test", kLargeBytes);
  ASSERT_TRUE(arena.ok() && mirrored.ok());
  const std::vector<uint32_t> secrets(1000, 0xdeadbeef), zeros(1000, 0);
  uint32_t at = 0, mirrored_at = 0;
  {
    Result<WordRange> theirs = arena->Allocate(1000), mirrored_theirs = mirrored->Allocate(1000);
    ASSERT_TRUE(theirs.ok() && mirrored_theirs.ok());
    arena->Write(*theirs, 0, std::span(secrets));
    mirrored->Write(*mirrored_theirs, 0, std::span(secrets));
    mirrored->Flush();
    EXPECT_EQ(Download(arena->buffer(), *theirs), secrets);
    EXPECT_EQ(Download(mirrored->buffer(), *mirrored_theirs), secrets);
    at = theirs->begin();
    mirrored_at = mirrored_theirs->begin();
  }
  const Result<WordRange> mine = arena->Allocate(1000), mirrored_mine = mirrored->Allocate(1000);
  ASSERT_TRUE(mine.ok() && mirrored_mine.ok());
  ASSERT_EQ(mine->begin(), at);
  ASSERT_EQ(mirrored_mine->begin(), mirrored_at);
  EXPECT_EQ(Download(arena->buffer(), *mine), zeros);
  EXPECT_EQ(mirrored->Read(*mirrored_mine, 0, 1000), zeros);
  mirrored->Flush();
  EXPECT_EQ(Download(mirrored->buffer(), *mirrored_mine), zeros);
}

TEST_F(DeviceArraysTest, MirrorSendsOnlyWhatChanged) {
  Result<MirroredBuffer> buffer = MirroredBuffer::Create("test", kLargeBytes);
  ASSERT_TRUE(buffer.ok());
  const std::vector<uint32_t> words = {1, 2, 3, 4};
  const auto bytes = std::as_bytes(std::span(words));
  EXPECT_EQ(buffer->Flush(), buffer->Mirror().size()) << "a new buffer is sent whole";
  buffer->Write(100, bytes);
  buffer->Write(40'000, bytes);
  EXPECT_EQ(buffer->Flush(), 32u) << "two parts far from each other";
  EXPECT_EQ(buffer->Flush(), 0u);
  buffer->Write(100, bytes);
  EXPECT_EQ(buffer->Flush(), 0u) << "the same bytes are not sent again";
  ASSERT_TRUE(buffer->Reserve(1 << 20).ok());
  EXPECT_EQ(buffer->Flush(), buffer->Mirror().size()) << "and so is a grown one";
  std::vector<uint32_t> read(4);
  buffer->buffer().Download(40'000, std::as_writable_bytes(std::span(read)));
  EXPECT_EQ(read, words) << "contents survive growing";
  EXPECT_EQ(buffer->Reserve(kLargeBytes + 1).reason(), "DEVICE_MEMORY");
}

TEST_F(DeviceArraysTest, MirroredArenaKeepsWhatWasWritten) {
  Result<MirroredArena> arena = MirroredArena::Create("test", kLargeBytes);
  ASSERT_TRUE(arena.ok());
  std::vector<WordRange> ranges;
  for (uint32_t k = 0; k < 40; ++k) {
    Result<WordRange> range = arena->Allocate(1000);
    ASSERT_TRUE(range.ok());
    ranges.push_back(std::move(range).value());
    const std::vector<uint32_t> words = {k, k + 1};
    arena->Write(ranges.back(), 7, words);
  }
  arena->Flush();
  for (uint32_t k = 0; k < 40; ++k) {
    EXPECT_THAT(arena->Read(ranges[k], 7, 2), ElementsAre(k, k + 1));
    EXPECT_EQ(Download(arena->buffer(), ranges[k])[8], k + 1);
  }
}

TEST_F(DeviceArraysTest, EqualModelObjectsAreUploadedOnce) {
  Result<DeviceArena> arena = DeviceArena::Create("models", kLargeBytes);
  ASSERT_TRUE(arena.ok());
  const uint64_t all_words = arena->free_words();
  ModelStore store(&arena.value());
  const auto model = GridModel(8, 8, {0});
  {
    const auto first = store.Acquire(model, {});
    ASSERT_TRUE(first.ok());
    const uint64_t with_one = arena->free_words();
    EXPECT_LT(with_one, all_words);
    const auto second = store.Acquire(model, {});
    ASSERT_TRUE(second.ok());
    EXPECT_EQ(first.value(), second.value());
    EXPECT_EQ(arena->free_words(), with_one);
    EXPECT_EQ(Download(arena->buffer(), first.value()->words), PackModel(*model).words);
    EXPECT_TRUE(store.Acquire(GridModel(8, 8, {0}), {}).ok());
  }
  EXPECT_EQ(arena->free_words(), all_words) << "the last cloth takes the model along";
}

TEST_F(DeviceArraysTest, EqualDistanceMapsAreUploadedOnce) {
  Result<DeviceArena> arena = DeviceArena::Create("models", kLargeBytes);
  ASSERT_TRUE(arena.ok());
  const auto map =
      DistanceMap::Build(test::BoxMesh({0, 0, 0}, {1, 0.5, 0.25}), {.resolution = 4}).value();
  MapStore store(&arena.value());
  {
    const auto first = store.Acquire(map);
    ASSERT_TRUE(first.ok());
    const uint64_t with_one = arena->free_words();
    EXPECT_EQ(store.Acquire(map).value(), first.value());
    EXPECT_EQ(arena->free_words(), with_one);
    const std::vector<uint32_t> words = Download(arena->buffer(), first.value()->words);
    ASSERT_EQ(words.size(), DRAPE_MAP_HEADER_WORDS + map->samples_m().size());
    EXPECT_THAT(std::vector(words.begin(), words.begin() + 3), ElementsAre(11, 9, 8));
    EXPECT_EQ(std::bit_cast<float>(words[3]), 0.25f);
    EXPECT_EQ(std::bit_cast<float>(words[4]), 4.0f);
    EXPECT_EQ(std::memcmp(words.data() + DRAPE_MAP_HEADER_WORDS, map->samples_m().data(),
                          map->samples_m().size_bytes()),
              0);
  }
  EXPECT_EQ(map.use_count(), 1) << "the last cloth takes the map along";
  EXPECT_EQ(arena->free_words(), arena->capacity_words());
}

TEST_F(DeviceArraysTest, AMapThatDoesNotFitIsRefused) {
  Result<DeviceArena> arena = DeviceArena::Create("models", 4096);
  ASSERT_TRUE(arena.ok());
  const auto map =
      DistanceMap::Build(test::BoxMesh({0, 0, 0}, {1, 1, 1}), {.resolution = 8}).value();
  MapStore store(&arena.value());
  EXPECT_EQ(store.Acquire(map).status().reason(), "DEVICE_MEMORY");
  EXPECT_EQ(map.use_count(), 1);
}

TEST(StateReaderRuns, AreAsFewAsThereCanBe) {
  const auto runs_of = [](const std::vector<uint32_t>& particles) {
    std::vector<std::pair<uint32_t, uint32_t>> runs;
    for (const ColumnRun& run : RunsOf(particles)) runs.emplace_back(run.first, run.count);
    return runs;
  };
  using Pair = std::pair<uint32_t, uint32_t>;
  EXPECT_THAT(runs_of({}), ElementsAre());
  EXPECT_THAT(runs_of({0}), ElementsAre(Pair{0, 3}));
  EXPECT_THAT(runs_of({1, 2, 3, 5, 8, 9}), ElementsAre(Pair{3, 9}, Pair{15, 3}, Pair{24, 6}));
}

// More words than one round holds, in columns of odd lengths, and more runs; into memory of the
// host that the device copies to, and, with a limit below what that takes, without.
TEST_F(DeviceArraysTest, StateReaderGathersColumnsInOrder) {
  Result<std::unique_ptr<KernelCache>> kernels = KernelCache::Create("", "", nullptr);
  ASSERT_TRUE(kernels.ok());
  const Result<const gl::Program*> pack = kernels.value()->General("pack", 32);
  ASSERT_TRUE(pack.ok());
  Result<DeviceArena> states = DeviceArena::Create("states", kLargeBytes);
  ASSERT_TRUE(states.ok());
  Result<WordRange> range = states->Allocate(200'000);
  ASSERT_TRUE(range.ok());
  std::vector<float> words(200'000);
  std::iota(words.begin(), words.end(), 0.0f);
  states->Write(range.value(), 0, std::span<const float>(words));

  std::vector<StateColumn> columns;
  for (int k = 0; k < 100; ++k) {
    for (const StateColumn column : {StateColumn{100'000, 50'001}, StateColumn{3, 1},
                                     StateColumn{0, 0}, StateColumn{7, 20'000}}) {
      columns.push_back(column);
    }
  }
  std::vector<float> expected;
  for (const StateColumn& column : columns) {
    expected.insert(expected.end(), words.begin() + column.begin,
                    words.begin() + column.begin + column.count);
  }
  std::vector<ColumnRun> runs{{0, 2}, {10'000, 9'001}};
  for (uint32_t k = 0; k < 400; ++k) runs.push_back({19'100 + 2 * k, 1});
  std::vector<StateColumn> wide;
  for (uint32_t k = 0; k < 50; ++k) wide.push_back({1000 * k, 20'000});
  std::vector<float> expected_of_runs;
  for (const StateColumn& column : wide) {
    for (const ColumnRun& run : runs) {
      const auto begin = words.begin() + column.begin + run.first;
      expected_of_runs.insert(expected_of_runs.end(), begin, begin + run.count);
    }
  }
  for (const int64_t max_bytes : {int64_t{64} << 10, int64_t{64} << 20}) {
    Result<StateReader> reader =
        StateReader::Create(pack.value(), max_bytes, {.group_count_x = 3, .group_count_y = 1});
    ASSERT_TRUE(reader.ok());
    for (int again = 0; again < 2; ++again) {
      std::vector<float> first(1000), rest(expected.size() - first.size());
      reader->Begin(states->buffer(), columns).Take({first, rest});
      first.insert(first.end(), rest.begin(), rest.end());
      EXPECT_TRUE(first == expected) << max_bytes;
      std::vector<float> of_runs(expected_of_runs.size());
      reader->Begin(states->buffer(), wide, runs).Take({of_runs});
      EXPECT_TRUE(of_runs == expected_of_runs) << max_bytes;
    }
  }
}

}  // namespace
}  // namespace drape
