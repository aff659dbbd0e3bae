#include "server/solver/gl_compute/free_list.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace drape {
namespace {

TEST(FreeListTest, FirstFitAndMerging) {
  FreeList list(100);
  EXPECT_EQ(list.Allocate(40), 0u);
  EXPECT_EQ(list.Allocate(30), 40u);
  EXPECT_EQ(list.Allocate(31), std::nullopt);
  EXPECT_EQ(list.Allocate(30), 70u);
  EXPECT_EQ(list.free_count(), 0u);
  list.Free(0, 40);
  list.Free(70, 30);
  EXPECT_EQ(list.Allocate(41), std::nullopt) << "two gaps do not make one";
  list.Free(40, 30);
  EXPECT_EQ(list.free_count(), 100u);
  EXPECT_EQ(list.Allocate(100), 0u) << "neighbouring gaps merge";
}

TEST(FreeListTest, GrowsAtTheEnd) {
  FreeList list(10);
  EXPECT_EQ(list.Allocate(8), 0u);
  EXPECT_EQ(list.CapacityFor(2), 10u);
  EXPECT_EQ(list.CapacityFor(5), 13u) << "the two free words at the end count";
  list.Grow(13);
  EXPECT_EQ(list.Allocate(5), 8u);
  EXPECT_EQ(list.CapacityFor(1), 14u);
}

TEST(FreeListTest, RangeGivesBackOnDestruction) {
  FreeList list(64);
  {
    const WordRange range(&list, *list.Allocate(32), 20, 32);
    EXPECT_EQ(range.count(), 20u);
    EXPECT_EQ(list.free_count(), 32u);
    WordRange moved = WordRange(&list, *list.Allocate(32), 32, 32);
    WordRange target;
    target = std::move(moved);
    EXPECT_EQ(target.begin(), 32u);
    EXPECT_EQ(list.free_count(), 0u);
  }
  EXPECT_EQ(list.free_count(), 64u);
}

// Against a plain list of taken words.
TEST(FreeListTest, RandomUseNeverOverlapsOrLeaks) {
  std::mt19937 random(7);
  FreeList list(500);
  std::set<uint64_t> taken;
  std::vector<std::pair<uint64_t, uint64_t>> ranges;
  for (int round = 0; round < 3000; ++round) {
    if (ranges.empty() || random() % 2 == 0) {
      const uint64_t count = 1 + random() % 40;
      const std::optional<uint64_t> begin = list.Allocate(count);
      if (!begin) continue;
      for (uint64_t word = *begin; word < *begin + count; ++word) {
        ASSERT_LT(word, 500u);
        ASSERT_TRUE(taken.insert(word).second);
      }
      ranges.emplace_back(*begin, count);
    } else {
      std::swap(ranges[random() % ranges.size()], ranges.back());
      const auto [begin, count] = ranges.back();
      ranges.pop_back();
      list.Free(begin, count);
      for (uint64_t word = begin; word < begin + count; ++word) taken.erase(word);
    }
    ASSERT_EQ(list.free_count(), 500 - taken.size());
  }
}

TEST(FreeListDeathTest, FreeingTwiceIsAProgrammerError) {
  FreeList list(10);
  list.Allocate(5);
  list.Free(0, 5);
  EXPECT_DEATH(list.Free(0, 5), "freed twice");
}

}  // namespace
}  // namespace drape
