#include "server/solver/gl_compute/strip_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "shaders/interface/bindings.h"
#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

constexpr uint32_t kLanes = DRAPE_STRIP_LANES;

struct Lane {
  uint32_t first, second, lane, link_count, place;
};

Lane LaneAt(const StripLanes& lanes, uint32_t slot, bool has_pairs) {
  const uint32_t word = lanes.words[DRAPE_STRIP_LANE_WORDS * slot];
  const uint32_t place = lanes.words[DRAPE_STRIP_LANE_WORDS * slot + 1];
  if (!has_pairs) return {word & 0x3ff, word & 0x3ff, word >> 10 & 31, word >> 15, place};
  return {word & 0x3ff, word >> 10 & 0x3ff, word >> 20 & 31, word >> 25, place};
}

// Each strip is there once, in neighbouring lanes of one group, in the lanes of its phase.
void ExpectLanes(const SceneModel& model) {
  const StripSet& strips = model.strips();
  ASSERT_TRUE(FitsInLanes(model));
  const bool has_pairs = HasLanePairs(model);
  const uint32_t particles_per_lane = has_pairs ? 2 : 1;
  const StripLanes lanes = FindStripLanes(model);
  ASSERT_EQ(lanes.phase_lanes.size(), strips.phase_count() + 1);
  ASSERT_EQ(lanes.words.size(), DRAPE_STRIP_LANE_WORDS * lanes.phase_lanes.back());
  const std::vector<uint32_t> counts = CountStripLanes(model);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    ASSERT_EQ(lanes.phase_lanes[phase + 1] - lanes.phase_lanes[phase], counts[phase]);
    ASSERT_EQ(counts[phase] % kLanes, 0u);
    uint32_t slot = lanes.phase_lanes[phase];
    for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
      while (LaneAt(lanes, slot, has_pairs).link_count == 0) ++slot;
      const uint32_t begin = strips.strip_offsets[s], links = strips.strip_offsets[s + 1] - begin;
      EXPECT_EQ(slot / kLanes, (slot + links / particles_per_lane) / kLanes) << "in two groups";
      for (uint32_t k = 0; k <= links; k += particles_per_lane, ++slot) {
        const Lane lane = LaneAt(lanes, slot, has_pairs);
        EXPECT_EQ(lane.first, strips.particles[begin + s + k]);
        EXPECT_EQ(lane.second,
                  strips.particles[begin + s + std::min(k + particles_per_lane - 1, links)]);
        EXPECT_EQ(lane.lane, k / particles_per_lane);
        EXPECT_EQ(lane.link_count, links);
        if (k < links) {
          EXPECT_EQ(lane.place, begin + k);
        }
        EXPECT_LT(lane.place, strips.constraints.size());
      }
    }
    for (; slot < lanes.phase_lanes[phase + 1]; ++slot)
      EXPECT_EQ(LaneAt(lanes, slot, has_pairs).link_count, 0u);
  }
}

TEST(StripLanesTest, EveryStripHasNeighbouringLanes) {
  for (const auto& [columns, rows] : {std::pair{32u, 5u},
                                      {5u, 3u},
                                      {2u, 2u},
                                      {17u, 30u},
                                      {32u, 16u},
                                      {32u, 32u},
                                      {27u, 31u},
                                      {31u, 17u}}) {
    SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows));
    ExpectLanes(*GridModel(columns, rows, {0, columns - 1}));
  }
  ExpectLanes(*BuildModel(ChainDescription(2, {0})));
  ExpectLanes(*BuildModel(ChainDescription(32)));
}

// As many strips share a group as fit: 4 of 8 particles, one of 17.
TEST(StripLanesTest, StripsShareGroups) {
  EXPECT_EQ(CountStripLanes(*GridModel(8, 8)), (std::vector<uint32_t>{64, 64}));
  EXPECT_EQ(CountStripLanes(*GridModel(17, 4)), (std::vector<uint32_t>{4 * 32, 3 * 32}));
  EXPECT_FALSE(FitsInLanes(*GridModel(33, 2)));
}

// By pairs of particles two of 31 or 32.
TEST(StripLanesTest, LanesOfLargeClothsHavePairs) {
  EXPECT_FALSE(HasLanePairs(*GridModel(32, 16)));
  EXPECT_TRUE(HasLanePairs(*GridModel(27, 19)));
  EXPECT_EQ(CountStripLanes(*GridModel(32, 32)), (std::vector<uint32_t>{512, 512}));
  EXPECT_EQ(CountStripLanes(*GridModel(31, 19)), (std::vector<uint32_t>{10 * 32, 11 * 32}));
  EXPECT_FALSE(FitsInLanes(*GridModel(33, 31)));
}

}  // namespace
}  // namespace drape
