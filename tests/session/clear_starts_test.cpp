#include "server/session/clear_starts.h"

#include <gtest/gtest.h>

#include "server/session/cloth_creation.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Copies of a pair of particles 1 m apart, each beside its own sphere if `offset_m` is 0.
ClothCreation PairsIn(const std::vector<Vector3d>& offsets_m, const std::vector<Pin>& pins = {}) {
  ClothCreation creation = Chains(offsets_m.size(), 2, pins);
  for (size_t k = 0; k < offsets_m.size(); ++k) {
    ClothCopy& copy = creation.copies[k];
    copy.transform.position_m = offsets_m[k];
    copy.parameters.colliders = {SphereAt({0.5, -0.1, 0}, 10)};
  }
  return creation;
}

class ClearStartsTest : public SessionFixture {
 protected:
  ClearStartsTest() { Start(); }

  // Positions of a cloth on the device, in the cloth frame.
  std::vector<Vector3d> PositionsOf(const ClothRecord& cloth) {
    std::vector<Vector3d> positions_m;
    Inspect([&](const FakeBackend& backend) {
      positions_m = backend.StateOf(cloth.runtime->handle()).positions_m;
    });
    return positions_m;
  }
};

TEST_F(ClearStartsTest, CopiesThatLieAlikeShareTheirStart) {
  const Vector3d zero = Vector3d::Zero();
  ClothCreation creation = PairsIn({zero, zero, {0, 0.5, 0}, {0, 50, 0}});
  ASSERT_TRUE(FindClearStarts(creation).ok());
  const auto& copies = creation.copies;
  ASSERT_NE(copies[0].start, nullptr);
  EXPECT_EQ(copies[0].start->clearance, StartClearance::kCleared);
  EXPECT_EQ(copies[0].start, copies[1].start);
  ASSERT_NE(copies[2].start, nullptr);
  EXPECT_NE(copies[0].start, copies[2].start);
  EXPECT_EQ(copies[3].start, nullptr) << "outside";
}

// The environment's place in the world and a common shift of cloth and collider change no bit: the
// search is in the cloth frame. 4096 m is a shift without rounding.
TEST_F(ClearStartsTest, FarAwayIsTheSame) {
  ClothCreation here = PairsIn({Vector3d::Zero()}), there = PairsIn({Vector3d(4096, 0, 0)});
  there.copies[0].parameters.colliders[0].pose.position_m.x() += 4096;
  there.copies[0].environment_origin_m = {1e6, 0.3, 0};
  ASSERT_TRUE(FindClearStarts(here).ok());
  ASSERT_TRUE(FindClearStarts(there).ok());
  EXPECT_EQ(here.copies[0].start->positions_m, there.copies[0].start->positions_m);
}

TEST_F(ClearStartsTest, ARequestHasSoManySearches) {
  std::vector<Vector3d> offsets_m;
  for (uint32_t k = 0; k < kMaxCaughtStarts; ++k) offsets_m.emplace_back(0, 0.001 * k, 0);
  ClothCreation most = PairsIn(offsets_m);
  ASSERT_TRUE(FindClearStarts(most).ok());
  offsets_m.emplace_back(0, -0.1, 0);
  ClothCreation more = PairsIn(offsets_m);
  EXPECT_EQ(FindClearStarts(more).reason(), "CAUGHT_STARTS");
}

TEST_F(ClearStartsTest, StopsWhenAsked) {
  ClothCreation creation = PairsIn({Vector3d::Zero()});
  StopWhenUnwanted at_once([] { return true; });
  EXPECT_THROW((void)FindClearStarts(creation, &at_once), WorkStopped);
  EXPECT_EQ(creation.copies[0].start, nullptr);
}

// A chain whose links cannot be kept outside: the search would go on for long.
TEST_F(ClearStartsTest, StopsWithinASearch) {
  ClothCreation creation = Chains(1, 2000);
  creation.copies[0].parameters.colliders = {SphereAt({1000, -5, 0}, 900)};
  size_t asked = 0;
  StopWhenUnwanted never([&] { return ++asked == 0; });
  ASSERT_TRUE(FindClearStarts(creation, &never).ok());
  ASSERT_GT(asked, 20u) << "the search was too short for this test";
  asked = 0;
  StopWhenUnwanted soon([&] { return ++asked == 10; });
  EXPECT_THROW((void)FindClearStarts(creation, &soon), WorkStopped);
  EXPECT_EQ(asked, 10u);
}

TEST_F(ClearStartsTest, ClothsAreMadeAndResetThere) {
  ClothCreation creation = PairsIn({Vector3d::Zero()});
  ASSERT_TRUE(FindClearStarts(creation).ok());
  const auto start = creation.copies[0].start;
  const auto created = Create(std::move(creation));
  ASSERT_TRUE(created.ok());
  EXPECT_EQ(created->start, start);
  const ClothList cloths = Find(created->ids);
  EXPECT_EQ(cloths[0]->start(), start);
  EXPECT_EQ(PositionsOf(*cloths[0]), start->positions_m);
  Step(cloths, 3);
  EXPECT_NE(PositionsOf(*cloths[0]), start->positions_m);
  ASSERT_TRUE(Reset(cloths).ok());
  EXPECT_EQ(PositionsOf(*cloths[0]), start->positions_m);
}

TEST_F(ClearStartsTest, CaughtClothsStartAsDescribed) {
  ClothCreation creation = PairsIn({Vector3d::Zero()}, {{0, std::nullopt}});
  ASSERT_TRUE(FindClearStarts(creation).ok());
  ASSERT_NE(creation.copies[0].start, nullptr);
  EXPECT_EQ(creation.copies[0].start->clearance, StartClearance::kCaught);
  const auto created = Create(std::move(creation));
  EXPECT_EQ(created->start->clearance, StartClearance::kCaught);
  EXPECT_EQ(PositionsOf(*Find(created->ids)[0]),
            (std::vector<Vector3d>{{-0.5, 0, 0}, {0.5, 0, 0}}));
}

// The positions of creation would violate other lengths: the model's are taken.
TEST_F(ClearStartsTest, OtherLengthsEndTheStart) {
  ClothCreation creation = PairsIn({Vector3d::Zero()});
  ASSERT_TRUE(FindClearStarts(creation).ok());
  const auto start = creation.copies[0].start;
  const ClothList cloths = Find(Create(std::move(creation))->ids);
  ClothChange longer;
  longer.model.distance_constraints = std::vector<DistanceConstraint>{{0, 1, 1.01, 0}};
  ASSERT_TRUE(Update(cloths, longer).ok());
  EXPECT_EQ(cloths[0]->start(), start) << "within what is not restored";
  longer.model.distance_constraints = std::vector<DistanceConstraint>{{0, 1, 1.5, 0}};
  ASSERT_TRUE(Update(cloths, longer).ok());
  EXPECT_EQ(cloths[0]->start(), nullptr);
  ASSERT_TRUE(Reset(cloths).ok());
  const std::vector<Vector3d> positions_m = PositionsOf(*cloths[0]);
  EXPECT_NEAR((positions_m[1] - positions_m[0]).norm(), 1.5, 1.5 * kRestoredError);
}

}  // namespace
}  // namespace drape
