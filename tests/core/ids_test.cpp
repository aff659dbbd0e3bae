#include "server/core/ids.h"

#include <gtest/gtest.h>

#include <type_traits>
#include <unordered_set>

namespace drape {
namespace {

TEST(SlotId, PackingIsReversibleAndKeepsBothHalves) {
  for (const ClothId id : {ClothId{.slot = 0, .generation = 1}, ClothId{.slot = 7, .generation = 9},
                           ClothId{.slot = 0xffffffffu, .generation = 0xfffffffeu}}) {
    EXPECT_EQ(ClothId::FromPacked(id.Packed()), id);
  }
  EXPECT_EQ((ClothId{.slot = 2, .generation = 1}).Packed(), 0x1'0000'0002u);
}

TEST(SlotId, AStaleIdDiffersFromItsSuccessor) {
  const ClothId old_id{.slot = 3, .generation = 1};
  const ClothId new_id{.slot = 3, .generation = 2};
  EXPECT_NE(old_id, new_id);
  EXPECT_NE(old_id.Packed(), new_id.Packed());
  EXPECT_EQ((std::unordered_set<ClothId>{old_id, new_id, old_id}).size(), 2u);
}

TEST(SlotId, KindsOfIdsDoNotMix) {
  EXPECT_FALSE((std::is_convertible_v<ClothId, ClothHandle>));
}

}  // namespace
}  // namespace drape
