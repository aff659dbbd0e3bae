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
  GroupCandidate Cloth(const FloatModel& model, uint32_t max_iterations = 1,
                       Direction direction = Direction::kAtEnd) {
    ClothParameters parameters = test::PlainParameters();
    parameters.settings.integration = Integration::kOneStep;
    parameters.settings.direction = direction;
    return {&model, LaneKey(model, FloatControls(model, parameters, false), max_iterations, false)};
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
                     const std::vector<GroupCandidate>& cloths) {
  std::multiset<uint32_t> seen;
  for (const StepGroup& group : groups) {
    seen.insert(group.begin(), group.end());
    for (const uint32_t k : group) {
      const bool is_alike =
          group.size() == 1 || (cloths[k].key && *cloths[k].key == *cloths[group[0]].key);
      EXPECT_TRUE(is_alike) << "cloth " << k;
    }
  }
  EXPECT_EQ(seen.size(), cloths.size());
  EXPECT_EQ(std::set<uint32_t>(seen.begin(), seen.end()).size(), cloths.size());
}

TEST_F(StepGroupsTest, FullGroupsFirstAndSmallRestsAlone) {
  std::vector<GroupCandidate> cloths(33, Cloth(model_));
  auto groups = FormGroups(cloths, 16, 2);
  ExpectPartition(groups, cloths);
  EXPECT_THAT(Sizes(groups), ElementsAre(16, 16, 1));
  cloths.resize(37, Cloth(model_));
  EXPECT_THAT(Sizes(FormGroups(cloths, 16, 2)), ElementsAre(16, 16, 5));
  EXPECT_THAT(FormGroups(cloths, 1, 2), Each(SizeIs(1))) << "a machine without lanes";
}

TEST_F(StepGroupsTest, EveryThreadGetsSome) {
  const std::vector<GroupCandidate> cloths(10, Cloth(model_));
  EXPECT_THAT(Sizes(FormGroups(cloths, 16, 1)), ElementsAre(10));
  EXPECT_THAT(Sizes(FormGroups(cloths, 16, 2)), ElementsAre(5, 5));
  EXPECT_THAT(FormGroups(cloths, 16, 10), Each(SizeIs(1)));
}

// Narrow groups take less time, and there are machines with four lanes.
TEST_F(StepGroupsTest, FourShareLanesWhereThereAreFew) {
  const std::vector<GroupCandidate> cloths(4, Cloth(model_));
  EXPECT_THAT(Sizes(FormGroups(cloths, 4, 1)), ElementsAre(4));
  EXPECT_THAT(Sizes(FormGroups(cloths, 8, 1)), ElementsAre(4));
  EXPECT_THAT(FormGroups(cloths, 16, 1), Each(SizeIs(1)));
}

TEST_F(StepGroupsTest, OnlyAlikeClothsShareLanes) {
  std::vector<GroupCandidate> cloths;
  for (int k = 0; k < 8; ++k) {
    cloths.push_back(Cloth(model_));
    cloths.push_back(Cloth(other_));
    cloths.push_back(Cloth(model_, 2));
    cloths.push_back(Cloth(model_, 1, Direction::kAtStart));
    cloths.push_back({&model_, std::nullopt});
  }
  const auto groups = FormGroups(cloths, 8, 1);
  ExpectPartition(groups, cloths);
  EXPECT_THAT(Sizes(groups), ElementsAre(8, 8, 8, 8, 1, 1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(groups[0], ElementsAre(0, 5, 10, 15, 20, 25, 30, 35)) << "in the order of the batch";
}

TEST_F(StepGroupsTest, ClothsThatHoldOtherParticlesShareLanesLast) {
  const auto sheet = [](std::vector<uint32_t> pins) {
    return test::Grid(5, 4, 1, 1, std::move(pins)).model;
  };
  FloatModelCache cache;
  const auto first = cache.Get(sheet({0})), second = cache.Get(sheet({7})),
             parted = cache.Get(sheet({0, 1}));  // one link less
  std::vector<GroupCandidate> cloths;
  for (int k = 0; k < 6; ++k) {
    cloths.push_back(Cloth(*first));
    cloths.push_back(Cloth(*second));
    cloths.push_back(Cloth(*parted));
  }
  const auto groups = FormGroups(cloths, 6, 1);
  ExpectPartition(groups, cloths);
  EXPECT_THAT(Sizes(groups), ElementsAre(6, 6, 6));
  EXPECT_THAT(groups[0], ElementsAre(0, 3, 6, 9, 12, 15)) << "of one model";
  EXPECT_THAT(Sizes(FormGroups(cloths, 12, 1)), ElementsAre(12, 6));
}

// Groups that need not know of them are the cheapest.
TEST_F(StepGroupsTest, ClothsThatGripOrAreAskedForImpulsesShareLanesLast) {
  std::vector<GroupCandidate> cloths(16, Cloth(model_));
  for (uint32_t k = 0; k < cloths.size(); ++k) {
    cloths[k].has_grips = k % 2 == 0;
    cloths[k].asks_for_impulses = k % 4 < 2;
  }
  const auto groups = FormGroups(cloths, 4, 1);
  ExpectPartition(groups, cloths);
  EXPECT_THAT(groups, ElementsAre(ElementsAre(3, 7, 11, 15), ElementsAre(1, 5, 9, 13),
                                  ElementsAre(2, 6, 10, 14), ElementsAre(0, 4, 8, 12)));
  EXPECT_THAT(Sizes(FormGroups(cloths, 16, 1)), ElementsAre(16)) << "all can share lanes";
}

TEST_F(StepGroupsTest, DampingDoesNotPartCloths) {
  ClothParameters parameters = test::PlainParameters();
  const auto key_of = [&](double damping_per_s) {
    parameters.damping_per_s = damping_per_s;
    return LaneKey(model_, FloatControls(model_, parameters, false), 1, false);
  };
  EXPECT_TRUE(key_of(0) == key_of(0.5));
}

TEST_F(StepGroupsTest, AnEmptyBatchHasNone) {
  EXPECT_THAT(FormGroups({}, 16, 2), SizeIs(0));
}

}  // namespace
}  // namespace drape::cpu
