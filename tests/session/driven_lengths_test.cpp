// What driven rest lengths count for.
#include "server/session/driven_lengths.h"

#include <gtest/gtest.h>

#include "server/session/control_rows.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

constexpr uint32_t kLinks = 1000;

class DrivenLengthsTest : public SessionFixture {
 protected:
  DrivenLengthsTest() {
    SessionLimits limits;
    limits.max_model_bytes = 4 << 20;
    Start(limits);
    cloths_ = Find(Create(Chains(40, kLinks + 1)).value().ids);
  }

  static StepControls Scaled(const ClothList& cloths) {
    std::vector<ControlRow<LengthScale>> rows;
    for (const auto& cloth : cloths) rows.push_back({cloth->id, {1.5, 0}});
    return ResolveControls({.length_scales = rows}, cloths).value();
  }
  Status Charge(const ClothList& cloths) {
    return session().ChargeDriven(DrivenBy(Scaled(cloths), cloths, {}));
  }
  // As a step does it.
  void Drive(const ClothList& cloths) {
    ASSERT_TRUE(Charge(cloths).ok());
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session().name();
    for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
    work.steps = 1;
    work.controls = Scaled(cloths);
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
    ASSERT_TRUE(outcome.Get().status.ok());
  }
  void Save(const ClothList& cloths) {
    Awaited<Result<SavedSummary>> saved;
    session().SaveStates(cloths, "here",
                         [saved](Result<SavedSummary> r) mutable { saved.Set(std::move(r)); });
    ASSERT_TRUE(saved.Get().ok());
  }

  ClothList cloths_;
};

TEST_F(DrivenLengthsTest, TheyCountOnceUntilTheirClothEnds) {
  size_t driven = 0;
  Status refused;
  while (driven < cloths_.size() && (refused = Charge({cloths_[driven]})).ok()) ++driven;
  ASSERT_GT(driven, 2u);
  ASSERT_LT(driven, cloths_.size()) << "nothing counts";
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(refused.message().find("max_model_bytes"), std::string::npos) << refused.message();
  EXPECT_TRUE(Charge({cloths_[0], cloths_[1]}).ok()) << "they count already";
  // All or none: two more would be one too many.
  ASSERT_TRUE(Delete({cloths_[0]}).ok());
  EXPECT_FALSE(Charge({cloths_[driven], cloths_[driven + 1]}).ok());
  EXPECT_TRUE(Charge({cloths_[driven]}).ok());
}

TEST_F(DrivenLengthsTest, ClothsThatBecomeADrivenOneCount) {
  Drive({cloths_[0]});
  Save({cloths_[0]});
  Awaited<Status> loaded;
  session().LoadStates("here", std::vector<ClothId>{cloths_[1]->id},
                       std::vector<ClothId>{cloths_[0]->id},
                       [loaded](const Status& s) mutable { loaded.Set(s); });
  // The places of their environments differ, but not their frames in them.
  ASSERT_TRUE(loaded.Get().ok()) << loaded.Get().message();
  EXPECT_EQ(cloths_[1]->held_lengths.count(), kLinks);
  EXPECT_EQ(cloths_[2]->held_lengths.count(), 0u);

  Awaited<Result<std::vector<ClothId>>> imported;
  session().ImportCloths(
      session().FindSaved("here")->cloths,
      [imported](Result<std::vector<ClothId>> r) mutable { imported.Set(std::move(r)); });
  ASSERT_TRUE(imported.Get().ok()) << imported.Get().status().message();
  EXPECT_EQ(Find(imported.Get().value())[0]->held_lengths.count(), kLinks);
}

}  // namespace
}  // namespace drape
