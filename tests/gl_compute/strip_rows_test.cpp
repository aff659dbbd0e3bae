#include "server/solver/gl_compute/strip_rows.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

struct LinkRow {
  uint32_t k, link_count, row;
};

LinkRow Unpack(uint32_t word) {
  return {word & 0x3ff, (word >> 10 & 0x3ff) + 1, word >> 20};
}

// Every link has a row of its own in its block, the links of a strip follow each other, and blocks
// hold whole strips in their order.
void ExpectRows(const SceneModel& model, bool is_resident) {
  const StripSet& strips = model.strips();
  const StripRows rows = FindStripRows(model, is_resident);
  ASSERT_EQ(rows.rows.size(), strips.constraints.size());
  ASSERT_EQ(rows.phase_blocks.size(), strips.phase_count() + 1);
  ASSERT_EQ(rows.block_strips.back(), strips.strip_count());
  const uint32_t levels = StripLevels(model, is_resident);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    ASSERT_EQ(rows.block_strips[rows.phase_blocks[phase]], strips.phase_offsets[phase]);
    for (uint32_t b = rows.phase_blocks[phase]; b < rows.phase_blocks[phase + 1]; ++b) {
      const uint32_t first = rows.block_strips[b], end = rows.block_strips[b + 1];
      ASSERT_LT(first, end);
      EXPECT_LE(uint64_t{2} * (end - first) << levels, rows.row_count) << "two per system";
      std::set<uint32_t> taken;
      for (uint32_t s = first; s < end; ++s) {
        const uint32_t begin = strips.strip_offsets[s], links = strips.strip_offsets[s + 1] - begin;
        for (uint32_t k = 0; k < links; ++k) {
          const LinkRow at = Unpack(rows.rows[begin + k]);
          EXPECT_EQ(at.k, k);
          EXPECT_EQ(at.link_count, links);
          EXPECT_EQ(at.row, Unpack(rows.rows[begin]).row + k);
          EXPECT_TRUE(taken.insert(at.row).second) << "row " << at.row << " twice";
          EXPECT_LT(at.row, rows.row_count + rows.row_count / 32);
        }
      }
    }
  }
}

TEST(StripRowsTest, EveryLinkHasARow) {
  for (const auto& [columns, rows] :
       {std::pair{32u, 32u}, {33u, 31u}, {5u, 3u}, {2u, 2u}, {16u, 64u}}) {
    SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows));
    ExpectRows(*GridModel(columns, rows, {0, columns - 1}), true);
    ExpectRows(*GridModel(columns, rows, {0, columns - 1}), false);
  }
  for (const uint32_t particles : {2u, 3u, 1024u}) {
    ExpectRows(*BuildModel(ChainDescription(particles, {0})), true);
  }
  ExpectRows(*GridModel(40, 50), false);
  ExpectRows(*GridModel(300, 7), false);
  ExpectRows(*GridModel(1025, 3, {0, 1024}), false);
}

// A phase of a resident cloth is one block; longer strips have larger blocks otherwise.
TEST(StripRowsTest, BlocksAreAsLargeAsTheLongestStripNeeds) {
  EXPECT_EQ(FindStripRows(*GridModel(32, 32), true).block_strips,
            (std::vector<uint32_t>{0, 32, 64}));
  EXPECT_EQ(LeastRows(GridModel(40, 40)->strips()), 256u);
  EXPECT_EQ(LeastRows(GridModel(300, 3)->strips()), 512u);
  EXPECT_EQ(LeastRows(GridModel(1025, 2)->strips()), 1024u);
  EXPECT_TRUE(FitsInRows(GridModel(32, 32)->strips(), 1024));
  EXPECT_FALSE(FitsInRows(GridModel(32, 32)->strips(), 512));
}

// Systems of at most 16 links are left for the elimination, where there are invocations enough.
TEST(StripRowsTest, LongStripsAreDividedIntoShortSystems) {
  EXPECT_EQ(StripLevels(*GridModel(8, 8), true), 0u);
  EXPECT_EQ(StripLevels(*GridModel(32, 32), true), 1u);
  EXPECT_EQ(StripLevels(*BuildModel(ChainDescription(1024, {0})), true), 6u);
  EXPECT_EQ(StripLevels(*GridModel(256, 256), false), 4u);
  EXPECT_EQ(AllStripLevels(GridModel(32, 32)->strips()), 5u);
  EXPECT_EQ(AllStripLevels(GridModel(34, 2)->strips()), 6u);
}

}  // namespace
}  // namespace drape
