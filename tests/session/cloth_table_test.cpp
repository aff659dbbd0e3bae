#include "server/session/cloth_table.h"

#include <gtest/gtest.h>

#include <set>

namespace drape {
namespace {

std::vector<std::shared_ptr<ClothRecord>> Records(size_t count) {
  std::vector<std::shared_ptr<ClothRecord>> records;
  for (size_t k = 0; k < count; ++k) {
    records.push_back(std::make_shared<ClothRecord>(Placement{}, RigidTransform{}, nullptr));
  }
  return records;
}

TEST(ClothTable, FindsWhatItHolds) {
  ClothTable table;
  const auto records = Records(3);
  table.Add(records, "a");
  EXPECT_EQ(table.size(), 3u);
  for (const auto& record : records) EXPECT_EQ(table.Find(record->id, "a"), record);
  EXPECT_LT(records[0]->creation_number, records[1]->creation_number);
}

TEST(ClothTable, AnotherSessionsIdAndUnknownOnesAreNotFound) {
  ClothTable table;
  const auto records = Records(1);
  table.Add(records, "a");
  EXPECT_EQ(table.Find(records[0]->id, "b"), nullptr);
  EXPECT_EQ(table.Find({77, 1}, "a"), nullptr);
  EXPECT_EQ(table.Find({0, 0}, "a"), nullptr);
  EXPECT_EQ(table.Find(ClothId::FromPacked(~uint64_t{0}), "a"), nullptr);
}

TEST(ClothTable, AStaleIdNeverReachesANewOwner) {
  ClothTable table;
  std::set<uint64_t> ids;
  for (int round = 0; round < 100; ++round) {
    const auto records = Records(2);
    table.Add(records, "a");
    for (const auto& record : records) EXPECT_TRUE(ids.insert(record->id.Packed()).second);
    table.Remove(records);
    for (const auto& record : records) EXPECT_EQ(table.Find(record->id, "a"), nullptr);
  }
  const auto records = Records(2);
  table.Add(records, "a");
  EXPECT_LT(records[0]->id.slot, 2u);  // the slots are used again
  EXPECT_EQ(table.size(), 2u);
}

TEST(ClothTable, RemovingTwiceRemovesOnce) {
  ClothTable table;
  const auto first = Records(1), second = Records(1);
  table.Add(first, "a");
  table.Remove(first);
  table.Add(second, "a");  // in the same slot
  table.Remove(first);
  EXPECT_EQ(table.Find(second[0]->id, "a"), second[0]);
  EXPECT_EQ(table.size(), 1u);
}

TEST(ClothTable, WhatComesBackFromAnEarlierTimeIssuesNoIdAgain) {
  std::set<uint64_t> ids;
  IssuedIds known;
  known.origin = {5, 7};
  for (uint32_t life = 0; life < 4; ++life) {
    ClothTable table(known);
    const auto early = Records(2);
    table.Add(early, "a");
    known = table.issued();
    ++known.returns;
    // What follows is in no checkpoint: other cloths in the same places and in new ones.
    table.Remove(early);
    const auto late = Records(3);
    table.Add(late, "a");
    for (const auto& records : {early, late}) {
      for (const auto& record : records) EXPECT_TRUE(ids.insert(record->id.Packed()).second);
    }
  }
}

TEST(ClothTable, IdsCountFromTheOrigin) {
  ClothTable table(ClothId{1000, 77});
  const auto records = Records(2);
  table.Add(records, "a");
  EXPECT_EQ(records[1]->id, (ClothId{1001, 78}));
  for (const auto& record : records) EXPECT_EQ(table.Find(record->id, "a"), record);
  EXPECT_EQ(table.Find({0, 1}, "a"), nullptr);
  EXPECT_EQ(table.Find({1001, 77}, "a"), nullptr);
  table.Remove(records);
  const auto next = Records(1);
  table.Add(next, "a");
  EXPECT_EQ(next[0]->id, (ClothId{1001, 79}));
}

}  // namespace
}  // namespace drape
