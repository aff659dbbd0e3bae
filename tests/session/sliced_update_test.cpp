// Changes of more cloths than one command takes: others come between, and nobody sees half of one.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/session/cloth_update.h"
#include "server/session/sliced_command.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Two slices and a part.
constexpr size_t kCloths = 2 * kSliceCloths + 100;

ClothChange Gravity(double z) {
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(0, 0, z);
  return change;
}

class SlicedUpdateTest : public SessionFixture {
 protected:
  SlicedUpdateTest() {
    Start();
    cloths_ = Find(Create(Chains(kCloths, 2)).value().ids);
    other_lease_ = registry_->Create(std::nullopt, "other").value();
    const auto ids = Create(*other_lease_, Chains(1, 2)).value().ids;
    other_ = other_lease_->FindCloths(ids).value();
    begin_ = device_->writes();
  }
  ~SlicedUpdateTest() override { other_lease_ = {}; }

  // Writes since the beginning.
  size_t writes() const { return device_->writes() - begin_; }

  // Of the device and the descriptions.
  std::vector<double> Gravities() {
    std::vector<double> z;
    Inspect([&](const FakeBackend& backend) {
      for (const auto& cloth : cloths_) {
        if (!cloth->runtime->is_alive()) continue;
        const double its = backend.ParametersOf(cloth->runtime->handle()).gravity_m_per_s2.z();
        EXPECT_EQ(cloth->description()->parameters.gravity_m_per_s2.z(), its);
        EXPECT_FALSE(cloth->runtime->is_held());
        if (z.empty() || z.back() != its) z.push_back(its);
      }
    });
    return z;  // one for each run of equal ones
  }

  Awaited<StepOutcome> BeginStepOf(const std::string& name, const ClothList& cloths,
                                   uint32_t steps) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = name;
    for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
    work.steps = steps;
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return outcome;
  }

  Status Save(const ClothList& cloths, const std::string& name) {
    Awaited<Status> done;
    session().SaveStates(cloths, name,
                         [done](const Result<SavedSummary>& r) mutable { done.Set(r.status()); });
    return done.Get();
  }
  Awaited<Status> BeginLoad(const std::string& name) {
    Awaited<Status> done;
    session().LoadStates(name, {}, {}, [done](const Status& s) mutable { done.Set(s); });
    return done;
  }

  ClothList cloths_;
  SessionLease other_lease_;
  ClothList other_;
  size_t begin_ = 0;
};

TEST_F(SlicedUpdateTest, OthersComeBetweenItsSlices) {
  Awaited<size_t> seen;
  scheduler_->HoldForTest();
  const auto updated = BeginUpdate(cloths_, Gravity(-1));
  ASSERT_TRUE(
      scheduler_->Post(other_lease_->name(), [=, this](Backend&) mutable { seen.Set(writes()); })
          .ok());
  const auto stepped = BeginStepOf(other_lease_->name(), other_, 1);
  size_t writes_at_step = 0;
  device_->OnItem([&](ClothHandle) { writes_at_step = writes(); });
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(updated.Get().ok());
  EXPECT_EQ(seen.Get(), kSliceCloths);
  EXPECT_TRUE(stepped.Get().status.ok());
  EXPECT_EQ(writes_at_step, kSliceCloths);
  EXPECT_EQ(Gravities(), std::vector<double>{-1});
}

TEST_F(SlicedUpdateTest, ItsClothsAreNotSteppedMeanwhile) {
  std::vector<size_t> writes_at_steps;
  const ClothHandle last = cloths_.back()->runtime->handle();
  Awaited<bool> is_running;
  device_->OnItem([&, is_running](ClothHandle cloth) mutable {
    if (cloth != last) return;
    writes_at_steps.push_back(writes());
    is_running.Set(true);
  });
  const auto running = BeginStepOf(session().name(), {cloths_.back()}, 1000);
  is_running.Get();
  EXPECT_TRUE(Update(cloths_, Gravity(-1)).ok());
  EXPECT_TRUE(running.Get().status.ok());
  EXPECT_EQ(writes_at_steps.size(), 1000u);
  for (const size_t count : writes_at_steps) EXPECT_TRUE(count == 0 || count == kCloths) << count;
}

// The device refuses a cloth of the third slice.
TEST_F(SlicedUpdateTest, AFailureInALaterSliceTakesEverythingBack) {
  constexpr size_t kPassed = 2 * kSliceCloths + 7;
  const auto before = cloths_[0]->description();
  device_->FailWrite(kPassed);
  const Status status = Update(cloths_, Gravity(-1)).status();
  EXPECT_EQ(status.reason(), "DEVICE_FULL");
  EXPECT_EQ(writes(), 2 * kPassed + 1);
  EXPECT_EQ(Gravities(), std::vector<double>{0});
  EXPECT_EQ(cloths_[0]->description(), before);
  EXPECT_TRUE(BeginStepOf(session().name(), cloths_, 1).Get().status.ok());
  EXPECT_TRUE(Update(cloths_, Gravity(-2)).ok());
  EXPECT_EQ(Gravities(), std::vector<double>{-2});
}

TEST_F(SlicedUpdateTest, OneThatIsStoppedChangesNothing) {
  Awaited<Result<UpdatedCloths>> done;
  size_t asked = 0;
  session().UpdateCloths(
      cloths_, Gravity(-1), [done](Result<UpdatedCloths> r) mutable { done.Set(std::move(r)); }, {},
      [&asked]() -> Status {
        if (++asked <= 2) return Status::Ok();
        return {StatusCode::kCancelled, "CANCELLED", "the client has gone"};
      });
  EXPECT_EQ(done.Get().status().reason(), "CANCELLED");
  EXPECT_EQ(writes(), 2 * 2 * kSliceCloths);
  EXPECT_EQ(Gravities(), std::vector<double>{0});
}

TEST_F(SlicedUpdateTest, ChangesOfTheSameClothsComeOneAfterTheOther) {
  scheduler_->HoldForTest();
  const auto first = BeginUpdate(cloths_, Gravity(-1));
  const auto second = BeginUpdate(cloths_, Gravity(-2));
  ClothChange pins;
  pins.pins = std::vector<Pin>{{0, std::nullopt}};
  const auto third = BeginUpdate({cloths_.back()}, pins);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(first.Get().ok());
  EXPECT_TRUE(second.Get().ok());
  EXPECT_TRUE(third.Get().ok()) << "its model was made for the description that there was";
  EXPECT_EQ(Gravities(), std::vector<double>{-2});
  EXPECT_EQ(cloths_.back()->description()->model->pin_count(), 1u);
}

TEST_F(SlicedUpdateTest, ADeletionWaitsForIt) {
  scheduler_->HoldForTest();
  const auto updated = BeginUpdate(cloths_, Gravity(-1));
  Awaited<Status> deleted;
  session().DeleteCloths({cloths_.back()}, [deleted](const Status& s) mutable { deleted.Set(s); });
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(updated.Get().ok());
  EXPECT_TRUE(deleted.Get().ok());
  EXPECT_EQ(Gravities(), std::vector<double>{-1});
  EXPECT_EQ(device_->live_cloths(), kCloths);  // with the other session's
}

TEST_F(SlicedUpdateTest, OneThatWasDeletedBeforeIsNamedAndNothingChanges) {
  EXPECT_TRUE(Delete({cloths_.back()}).ok());
  const Status status = Update(cloths_, Gravity(-1)).status();
  EXPECT_EQ(status.reason(), "CLOTH_NOT_FOUND");
  EXPECT_NE(status.message().find(std::to_string(cloths_.back()->id.Packed())), std::string::npos);
  EXPECT_EQ(Gravities(), std::vector<double>{0});
  EXPECT_EQ(writes(), 0u);
}

TEST_F(SlicedUpdateTest, OverridesOfAResetAreSliced) {
  ClothStarts starts;
  starts.overrides.resize(kCloths);
  for (ParameterOverride& its : starts.overrides) its.gravity_m_per_s2 = Vector3d(0, 0, -3);
  EXPECT_TRUE(BeginStepOf(session().name(), cloths_, 2).Get().status.ok());
  Awaited<Status> done;
  Awaited<size_t> seen;
  scheduler_->HoldForTest();
  session().ResetCloths(cloths_, starts, [done](const Status& s) mutable { done.Set(s); });
  ASSERT_TRUE(
      scheduler_->Post(other_lease_->name(), [=, this](Backend&) mutable { seen.Set(writes()); })
          .ok());
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(done.Get().ok());
  EXPECT_EQ(seen.Get(), kSliceCloths);
  EXPECT_EQ(writes(), 2 * kCloths);
  EXPECT_EQ(Gravities(), std::vector<double>{-3});
  for (const auto& cloth : cloths_) EXPECT_EQ(cloth->runtime->progress().completed_steps, 0u);
}

TEST_F(SlicedUpdateTest, ALoadIsNotMetByADeletionHalfWay) {
  EXPECT_TRUE(Save(cloths_, "zero").ok());
  EXPECT_TRUE(BeginStepOf(session().name(), cloths_, 2).Get().status.ok());
  scheduler_->HoldForTest();
  const auto loaded = BeginLoad("zero");
  Awaited<Status> deleted;
  session().DeleteCloths({cloths_.back()}, [deleted](const Status& s) mutable { deleted.Set(s); });
  const auto stepped = BeginStepOf(session().name(), {cloths_.front()}, 1);
  std::vector<size_t> writes_at_steps;
  device_->OnItem([&](ClothHandle) { writes_at_steps.push_back(writes()); });
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(loaded.Get().ok()) << loaded.Get().ToString();
  EXPECT_TRUE(deleted.Get().ok());
  EXPECT_TRUE(stepped.Get().status.ok());
  EXPECT_EQ(writes_at_steps, std::vector<size_t>{kCloths});
  for (size_t k = 1; k < cloths_.size(); ++k) {
    EXPECT_EQ(cloths_[k]->runtime->progress().completed_steps, 0u) << k;
  }
}

TEST_F(SlicedUpdateTest, WhatIsSavedIsOneMoment) {
  Awaited<bool> is_running;
  size_t items = 0;
  std::vector<size_t> items_at_reads;
  device_->OnItem([&items, is_running](ClothHandle) mutable {
    ++items;
    is_running.Set(true);
  });
  device_->OnRead([&](size_t) { items_at_reads.push_back(items); });
  const auto running = BeginStepOf(session().name(), cloths_, 100);
  is_running.Get();
  EXPECT_TRUE(Save(cloths_, "moment").ok());
  EXPECT_TRUE(running.Get().status.ok());
  // Its slices, among the reads that tell whether cloths are at rest.
  const std::vector<size_t> reads = device_->reads();
  const std::vector<size_t> slices = {kSliceCloths, kSliceCloths, 100};
  const auto found = std::ranges::search(reads, slices);
  ASSERT_FALSE(found.empty());
  const size_t first = found.begin() - reads.begin();
  EXPECT_GT(items_at_reads[first], 0u);
  EXPECT_EQ(items_at_reads[first], items_at_reads[first + 2]);
  EXPECT_EQ(session().FindSaved("moment")->cloths.size(), kCloths);
}

TEST_F(SlicedUpdateTest, NothingIsSavedWhereOneWasDeleted) {
  EXPECT_TRUE(Delete({cloths_.back()}).ok());
  const Status status = Save(cloths_, "half");
  EXPECT_EQ(status.reason(), "CLOTH_NOT_FOUND");
  EXPECT_NE(status.message().find(std::to_string(cloths_.back()->id.Packed())), std::string::npos);
  EXPECT_EQ(session().FindSaved("half"), nullptr);
  EXPECT_EQ(session().saved_budget().used_bytes(), 0u);
}

}  // namespace
}  // namespace drape
