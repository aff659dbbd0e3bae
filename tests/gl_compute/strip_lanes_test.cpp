#include "server/solver/gl_compute/strip_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "shaders/interface/bindings.h"
#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

constexpr uint32_t kLanes = DRAPE_STRIP_LANES;

struct Lane {
  std::vector<uint32_t> particles;
  uint32_t end;        // 1 + the place of the last one in its strip; 0: no lane
  uint32_t last_link;  // of the strip; with quads its last lane
  uint32_t place;      // of the lane's first link; with quads of the first one of the strip
};

Lane LaneAt(const StripLanes& lanes, uint32_t slot, bool has_quads) {
  const uint32_t first = lanes.words[DRAPE_STRIP_LANE_WORDS * slot];
  const uint32_t second = lanes.words[DRAPE_STRIP_LANE_WORDS * slot + 1];
  if (has_quads) {
    return {{first & 0x3ff, first >> 10 & 0x3ff, first >> 20, second & 0x3ff},
            second >> 10 & 63,
            second >> 16 & 7,
            second >> 19};
  }
  const uint32_t links = first >> 15;
  if (links == 0) return {{}, 0, 0, second};
  return {{first & 0x3ff}, (first >> 10 & 31) + 1, links - 1, second};
}

// The lanes of a strip, whose links have this place in the lists of links.
void ExpectStrip(const StripLanes& lanes, uint32_t slot, std::span<const uint32_t> particles,
                 uint32_t place) {
  const auto links = static_cast<uint32_t>(particles.size()) - 1;
  for (uint32_t k = 0; k <= links; ++k) {
    const Lane lane = LaneAt(lanes, slot + k, false);
    EXPECT_EQ(lane.particles[0], particles[k]);
    EXPECT_EQ(lane.end, k + 1);
    EXPECT_EQ(lane.last_link, links - 1);
    EXPECT_EQ(lane.place, place + std::min(k, links - 1));
  }
}

// The same by quads, which end with the last particle.
void ExpectQuads(const StripLanes& lanes, uint32_t slot, std::span<const uint32_t> particles,
                 uint32_t place) {
  const auto count = static_cast<uint32_t>(particles.size());
  const uint32_t last_lane = (count - 1) / 4;
  for (uint32_t k = 0; k <= last_lane; ++k) {
    const Lane lane = LaneAt(lanes, slot + k, true);
    EXPECT_EQ(lane.end, count - 4 * (last_lane - k));
    for (uint32_t p = 0; p < 4; ++p) {
      EXPECT_EQ(lane.particles[p], particles[lane.end + p < 4 ? 0 : lane.end + p - 4]);
    }
    EXPECT_EQ(lane.last_link, last_lane);
    EXPECT_EQ(lane.place, place);
  }
}

// Each strip is there once, in neighbouring lanes of one group, in the lanes of its phase.
void ExpectLanes(const SceneModel& model) {
  const StripSet& strips = model.strips();
  ASSERT_TRUE(FitsInLanes(model));
  const bool has_quads = HasLaneQuads(model);
  const uint32_t particles_per_lane = has_quads ? 4 : 1;
  const StripLanes lanes = FindStripLanes(model);
  ASSERT_EQ(lanes.phase_lanes.size(), strips.phase_count() + 1);
  ASSERT_EQ(lanes.words.size(), DRAPE_STRIP_LANE_WORDS * lanes.phase_lanes.back());
  const std::vector<uint32_t> counts = CountStripLanes(model);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    ASSERT_EQ(lanes.phase_lanes[phase + 1] - lanes.phase_lanes[phase], counts[phase]);
    ASSERT_EQ(counts[phase] % kLanes, 0u);
    uint32_t slot = lanes.phase_lanes[phase];
    for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
      while (LaneAt(lanes, slot, has_quads).end == 0) ++slot;
      const uint32_t begin = strips.strip_offsets[s], links = strips.strip_offsets[s + 1] - begin;
      const auto particles =
          std::span<const uint32_t>(strips.particles).subspan(begin + s, links + 1);
      const uint32_t last_lane = links / particles_per_lane;
      EXPECT_EQ(slot / kLanes, (slot + last_lane) / kLanes) << "in two groups";
      (has_quads ? ExpectQuads : ExpectStrip)(lanes, slot, particles, begin);
      slot += last_lane + 1;
    }
    for (; slot < lanes.phase_lanes[phase + 1]; ++slot)
      EXPECT_EQ(LaneAt(lanes, slot, has_quads).end, 0u);
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
                                      {31u, 17u},
                                      {30u, 29u}}) {
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

// Four strips of 29 to 32 particles share a group, five of 21 to 24.
TEST(StripLanesTest, LanesOfLargeClothsHaveQuads) {
  EXPECT_FALSE(HasLaneQuads(*GridModel(32, 16)));
  EXPECT_TRUE(HasLaneQuads(*GridModel(27, 19)));
  EXPECT_EQ(CountStripLanes(*GridModel(32, 32)), (std::vector<uint32_t>{256, 256}));
  EXPECT_EQ(CountStripLanes(*GridModel(24, 31)), (std::vector<uint32_t>{6 * 32, 7 * 32}));
  EXPECT_FALSE(FitsInLanes(*GridModel(33, 31)));
}

}  // namespace
}  // namespace drape
