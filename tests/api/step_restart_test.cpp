// How much may start again within a step.
#include "server/api/step_restart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"

namespace drape::api {
namespace {

using testing::HasSubstr;

class StepRestartTest : public SessionFixture {
 protected:
  StepRestartTest() { Start(); }

  // Of a step that starts the first `count` of the cloths again.
  CheckedStep Resets(const ClothList& cloths, size_t count, bool have_overrides) {
    CheckedStep checked;
    for (size_t k = 0; k < count; ++k) checked.resets.cloths.push_back(cloths[k]->id);
    if (have_overrides) checked.resets.starts.overrides.resize(count);
    return checked;
  }
  Status Add(const CheckedStep& checked, const ClothList& cloths) {
    StepWork work;
    return AddRestarts(checked, session(), cloths, work).status();
  }
};

// Every cloth of a session may, where it is small and has nothing else; with other parameters half
// of them.
TEST_F(StepRestartTest, ManySmallClothsMay) {
  const ClothList cloths = Find(Create(Chains(65536, 2)).value().ids);
  EXPECT_TRUE(Add(Resets(cloths, 65536, false), cloths).ok());
  EXPECT_TRUE(Add(Resets(cloths, 32768, true), cloths).ok());
  const Status status = Add(Resets(cloths, 32769, true), cloths);
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  ASSERT_EQ(status.violations().size(), 1u);
  EXPECT_EQ(status.violations()[0].field, "resets.cloth_ids");
  EXPECT_THAT(status.violations()[0].description, HasSubstr("cost 16777728, at most 16777216"));
}

TEST_F(StepRestartTest, CollidersCount) {
  ClothCreation creation = Chains(2049, 2);
  for (ClothCopy& copy : creation.copies) {
    copy.parameters.colliders.assign(256, SphereAt({0, -9, 0}, 0.5));
  }
  const ClothList cloths = Find(Create(std::move(creation)).value().ids);
  EXPECT_TRUE(Add(Resets(cloths, 2048, false), cloths).ok());
  EXPECT_EQ(Add(Resets(cloths, 2049, false), cloths).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Add(Resets(cloths, 2048, true), cloths).code(), StatusCode::kInvalidArgument);
}

TEST_F(StepRestartTest, LoadsCountLikeOverrides) {
  const ClothList cloths = Find(Create(Chains(32769, 2)).value().ids);
  Awaited<Result<SavedSummary>> saved;
  session().SaveStates(cloths, "here",
                       [saved](Result<SavedSummary> r) mutable { saved.Set(std::move(r)); });
  ASSERT_TRUE(saved.Get().ok());
  CheckedStep checked;
  checked.loads.name = "here";
  for (size_t k = 0; k < 32768; ++k) checked.loads.cloths.push_back(cloths[k]->id);
  EXPECT_TRUE(Add(checked, cloths).ok());
  checked.loads.cloths.push_back(cloths[32768]->id);
  const Status status = Add(checked, cloths);
  ASSERT_EQ(status.violations().size(), 1u);
  EXPECT_EQ(status.violations()[0].field, "loads.cloth_ids");
}

}  // namespace
}  // namespace drape::api
