#include "server/solver/cpu/step_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::SizeIs;

class StepGroupsTest : public testing::Test {
 protected:
  LaneKey Key(const FloatModel& model, uint32_t max_iterations = 1,
              Direction direction = Direction::kAtEnd) {
    ClothParameters parameters = test::PlainParameters();
    parameters.settings.integration = Integration::kOneStep;
    parameters.settings.direction = direction;
    return {model, FloatControls(model, parameters, false), max_iterations};
  }

  const FloatModel model_{test::SizedCloth(33).model};
  const FloatModel other_{test::SizedCloth(31).model};
};

std::vector<size_t> Sizes(const std::vector<StepGroup>& groups) {
  std::vector<size_t> sizes;
  for (const StepGroup& group : groups) sizes.push_back(group.size());
  return sizes;
}

// Every cloth occurs once; the cloths of a group have the same shape.
void ExpectPartition(const std::vector<StepGroup>& groups,
                     const std::vector<std::optional<LaneKey>>& keys) {
  std::multiset<uint32_t> seen;
  for (const StepGroup& group : groups) {
    seen.insert(group.begin(), group.end());
    for (const uint32_t k : group) {
      const bool is_alike = group.size() == 1 || (keys[k] && *keys[k] == *keys[group[0]]);
      EXPECT_TRUE(is_alike) << "cloth " << k;
    }
  }
  EXPECT_EQ(seen.size(), keys.size());
  EXPECT_EQ(std::set<uint32_t>(seen.begin(), seen.end()).size(), keys.size());
}

TEST_F(StepGroupsTest, FullGroupsFirstAndSmallRestsAlone) {
  std::vector<std::optional<LaneKey>> keys(33, Key(model_));
  auto groups = FormGroups(keys, 16, 2);
  ExpectPartition(groups, keys);
  EXPECT_THAT(Sizes(groups), ElementsAre(16, 16, 1));
  keys.resize(37, Key(model_));
  EXPECT_THAT(Sizes(FormGroups(keys, 16, 2)), ElementsAre(16, 16, 5));
  EXPECT_THAT(FormGroups(keys, 1, 2), Each(SizeIs(1))) << "a machine without lanes";
}

TEST_F(StepGroupsTest, EveryThreadGetsSome) {
  const std::vector<std::optional<LaneKey>> keys(8, Key(model_));
  EXPECT_THAT(Sizes(FormGroups(keys, 16, 1)), ElementsAre(8));
  EXPECT_THAT(Sizes(FormGroups(keys, 16, 2)), ElementsAre(4, 4));
  EXPECT_THAT(FormGroups(keys, 16, 8), Each(SizeIs(1)));
}

TEST_F(StepGroupsTest, OnlyAlikeClothsShareLanes) {
  std::vector<std::optional<LaneKey>> keys;
  for (int k = 0; k < 8; ++k) {
    keys.push_back(Key(model_));
    keys.push_back(Key(other_));
    keys.push_back(Key(model_, 2));
    keys.push_back(Key(model_, 1, Direction::kAtStart));
    keys.push_back(std::nullopt);
  }
  const auto groups = FormGroups(keys, 8, 1);
  ExpectPartition(groups, keys);
  EXPECT_THAT(Sizes(groups), ElementsAre(8, 8, 8, 8, 1, 1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(groups[0], ElementsAre(0, 5, 10, 15, 20, 25, 30, 35)) << "in the order of the batch";
}

TEST_F(StepGroupsTest, DampingDoesNotPartCloths) {
  ClothParameters parameters = test::PlainParameters();
  const auto key_of = [&](double damping_per_s) {
    parameters.damping_per_s = damping_per_s;
    return LaneKey(model_, FloatControls(model_, parameters, false), 1);
  };
  EXPECT_TRUE(key_of(0) == key_of(0.5));
}

TEST_F(StepGroupsTest, AnEmptyBatchHasNone) {
  EXPECT_THAT(FormGroups({}, 16, 2), SizeIs(0));
}

}  // namespace
}  // namespace drape::cpu
