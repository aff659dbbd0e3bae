#include "server/scheduler/sliced_read.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

class SlicedReads : public testing::Test {
 protected:
  SlicedReads() {
    for (const uint32_t particles : {4u, 3u, 5u, 2u}) {
      cloths_.push_back(BeginCloth(backend_, ChainModel(particles)));
    }
    const StepItem second{cloths_[1]->handle(), {}, false};
    backend_.Step(std::span(&second, 1));
  }

  std::ptrdiff_t HeldCloths() const {
    return std::ranges::count_if(cloths_, [](const auto& cloth) { return cloth->is_held(); });
  }

  const std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeBackend backend_{device_};
  std::vector<std::shared_ptr<ClothRuntime>> cloths_;
};

TEST_F(SlicedReads, GiveWhatOneReadGives) {
  for (const StateFields& fields :
       {StateFields{true, false}, StateFields{true, true}, StateFields{false, true},
        StateFields{.positions = true, .particles = {0, 1}}}) {
    const ClothStates expected = ReadClothStates(backend_, cloths_, fields);
    for (const size_t rows : {size_t{1}, size_t{7}, size_t{100}}) {
      SlicedRead read(cloths_, fields, rows);
      size_t slices = 1;
      while (!read.ReadMore(backend_)) {
        ++slices;
        EXPECT_EQ(HeldCloths(), 4);
      }
      EXPECT_EQ(HeldCloths(), 0);
      if (rows == 1) {
        EXPECT_EQ(slices, 4u);
      }
      if (rows == 100) {
        EXPECT_EQ(slices, 1u);
      }
      const ClothStates states = read.Take();
      EXPECT_EQ(states.cloths.size(), 4u);
      EXPECT_EQ(states.columns.positions_m, expected.columns.positions_m);
      EXPECT_EQ(states.columns.velocities_m_per_s, expected.columns.velocities_m_per_s);
    }
  }
}

TEST_F(SlicedReads, ReadEachClothAsOftenAsItIsNamed) {
  cloths_.push_back(cloths_[1]);
  SlicedRead read(cloths_, {true, false}, 3);
  while (!read.ReadMore(backend_)) continue;
  EXPECT_EQ(HeldCloths(), 0);
  EXPECT_EQ(read.Take().cloths.size(), 5u);
}

TEST_F(SlicedReads, LetGoOfTheClothsWhenTheyAreGivenUp) {
  SlicedRead read(cloths_, {true, false}, 1);
  EXPECT_FALSE(read.ReadMore(backend_));
  EXPECT_EQ(HeldCloths(), 4);
  read.Release();
  EXPECT_EQ(HeldCloths(), 0);
}

using SlicedReadsOfAServer = SchedulerTest;

// Each cloth is a slice: the steps of others come between, those of the cloths that are read after.
TEST_F(SlicedReadsOfAServer, LetOthersStepBetweenTheSlices) {
  Start();
  const auto model = ChainModel(static_cast<uint32_t>(kReadRowsPerSlice));
  std::vector<std::shared_ptr<ClothRuntime>> large;
  const Status made = scheduler_->RunBlocking([&](Backend& backend) {
    for (int k = 0; k < 4; ++k) large.push_back(BeginCloth(backend, model));
    return Status::Ok();
  });
  ASSERT_TRUE(made.ok());
  const auto other = Cloth();
  std::vector<std::string> order;  // device thread
  device_->OnRead([&](size_t) { order.push_back("read"); });
  device_->OnItem(
      [&](ClothHandle cloth) { order.push_back(cloth == other->handle() ? "other" : "own"); });
  Awaited<Result<ClothStates>> read;
  scheduler_->HoldForTest();
  const auto into = [read](Result<ClothStates> result) mutable { read.Set(std::move(result)); };
  ASSERT_TRUE(scheduler_->ReadStates(large, {true, false}, into, "a").ok());
  Awaited<StepOutcome> own_step = Submit("a", {large[3]});
  Awaited<StepOutcome> other_step = Submit("b", {other}, 10);
  scheduler_->ReleaseForTest();
  const Result<ClothStates> states = read.Get();
  EXPECT_TRUE(own_step.Get().status.ok());
  EXPECT_TRUE(other_step.Get().status.ok());
  scheduler_->Drain(0);
  ASSERT_TRUE(states.ok());
  EXPECT_EQ(std::get<std::vector<double>>(states->columns.positions_m).size(),
            3 * 4 * kReadRowsPerSlice);
  for (const ClothStamp& stamp : states->cloths) EXPECT_EQ(stamp.completed_steps, 0u);
  const auto own = std::ranges::find(order, "own");
  EXPECT_EQ(std::count(order.begin(), own, "read"), 4);
  EXPECT_GE(std::count(order.begin(), own, "other"), 3);
}

}  // namespace
}  // namespace drape
