#include "server/core/rate_quota.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <thread>

#include "tests/scheduler/device_loop_fixture.h"
#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

constexpr int64_t kSecond_us = 1'000'000;

class Rates : public testing::Test {
 protected:
  int64_t Wait_us(const std::string& tenant) {
    return rates_.WaitUntil_us(tenant) - clock_.NowUs();
  }

  FakeClock clock_;
  RateQuota rates_{clock_};
};

TEST_F(Rates, ADebtIsPaidAtTheRateOfTheTenant) {
  rates_.Set({.per_tenant = 1000});
  rates_.Charge("a", 1000);  // what a second saves up
  EXPECT_EQ(Wait_us("a"), 0);
  rates_.Charge("a", 500);
  EXPECT_NEAR(static_cast<double>(Wait_us("a")), 0.5e6, 2);
  EXPECT_EQ(Wait_us("b"), 0);
  clock_.AdvanceUs(Wait_us("a"));
  EXPECT_EQ(Wait_us("a"), 0);
}

TEST_F(Rates, AnIdleTenantSavesUpOneSecond) {
  rates_.Set({.per_tenant = 1000});
  rates_.Charge("a", 1);
  clock_.AdvanceUs(3600 * kSecond_us);
  rates_.Charge("a", 1000);
  EXPECT_EQ(Wait_us("a"), 0);
  rates_.Charge("a", 1);
  EXPECT_GT(Wait_us("a"), 0);
}

TEST_F(Rates, TenantsMayHaveRatesOfTheirOwn) {
  EXPECT_FALSE(rates_.has_limits());
  rates_.Set({.per_tenant = 0, .of_tenant = {{"slow", 10}}});
  EXPECT_TRUE(rates_.has_limits());
  rates_.Set({.per_tenant = 1000, .of_tenant = {{"slow", 10}, {"free", 0}}});
  for (const char* tenant : {"slow", "free", "other", ""}) rates_.Charge(tenant, 1e6);
  EXPECT_GT(Wait_us("slow"), 1000 * kSecond_us);
  EXPECT_EQ(Wait_us("free"), 0);
  EXPECT_GT(Wait_us("other"), 990 * kSecond_us);
  EXPECT_LT(Wait_us("other"), 1000 * kSecond_us);
  EXPECT_EQ(Wait_us(""), 0) << "without tokens there are no tenants";
  rates_.Set({.per_tenant = 1000, .of_tenant = {{"slow", 1e6}}});
  EXPECT_LT(Wait_us("slow"), kSecond_us) << "a debt is paid at the new rate";
}

TEST_F(Rates, WhatTenantsHadIsCountedWithoutLimitsToo) {
  rates_.Charge("b", 100);
  rates_.Charge("a", 10);
  rates_.Charge("a", 5);
  std::vector<RateUse> uses = rates_.Uses();
  ASSERT_EQ(uses.size(), 2u);
  EXPECT_EQ(uses[0].tenant, "a");
  EXPECT_EQ(uses[0].work, 15);
  EXPECT_EQ(uses[1].work_per_s, 100 / RateQuota::kMean_s);
  clock_.AdvanceUs(5 * kSecond_us);
  uses = rates_.Uses();
  EXPECT_NEAR(uses[1].work_per_s, 20 * std::exp(-1.0), 1e-12);
  EXPECT_EQ(uses[1].wait_us, 0);
}

// The mean rate of steady work is the rate: with m = kMean_s, work w every T gives the sum of a
// geometric series, w / m / (1 - exp(-T/m)), which is w/T to within T/2m, here 1 %.
TEST_F(Rates, TheMeanOfSteadyWorkIsItsRate) {
  for (int k = 0; k < 1000; ++k) {
    clock_.AdvanceUs(kSecond_us / 10);
    rates_.Charge("a", 50);
  }
  EXPECT_NEAR(rates_.Uses()[0].work_per_s, 500, 5.1);
}

// Particle-substeps of a step of these cloths: two particles, as many substeps as plain settings
// have.
const double kStep = 2.0 * test::PlainParameters().settings.substeps;

class RateOfLoop : public DeviceLoopTest {
 protected:
  StepWork WorkOf(const std::string& tenant, const std::string& name,
                  const std::shared_ptr<ClothRuntime>& cloth, uint32_t steps) {
    StepWork work = Work(name, {cloth}, steps);
    work.tenant = tenant;
    return work;
  }
  static double Steps(const ClothRuntime& cloth) {
    return static_cast<double>(cloth.now().completed_steps);
  }
};

TEST_F(RateOfLoop, WorkBeyondTheRateWaitsAndOthersDoNot) {
  const auto slow = Cloth(), quick = Cloth();
  rates_.Set({.per_tenant = 0, .of_tenant = {{"slow", 10 * kStep}}});  // 10 steps/s, 10 at once
  Admit(WorkOf("slow", "slow", slow, 100));
  Admit(WorkOf("quick", "quick", quick, 1000));
  // A round takes 10 ms.
  for (int round = 0; round < 500; ++round) {
    loop_->RunRound();
    EXPECT_EQ(Steps(*quick), round + 1) << "others have a step in every round";
    EXPECT_FALSE(loop_->RestUntil_us().has_value()) << "the quick one goes on";
    // At most the rate, the bucket, and the batch in which it ran empty.
    EXPECT_LE(Steps(*slow), 10 + round / 10 + 1);
    clock_.AdvanceUs(10'000);
  }
  // 5 s: the bucket of 10, 10 a second, and one on credit.
  EXPECT_GE(Steps(*slow), 59);
  EXPECT_TRUE(outcomes_.empty()) << "nothing failed";
}

TEST_F(RateOfLoop, TheLoopRestsWhileEverybodyIsHeldBackAndLooksForThoseWhoGaveUp) {
  const auto cloth = Cloth(), behind = cloth;
  rates_.Set({.per_tenant = 10 * kStep});
  Admit(WorkOf("slow", "first", cloth, 30));
  Admit(WorkOf("slow", "behind", behind, 1));
  StepWork other = WorkOf("slow", "other", Cloth(), 30);
  CancelToken cancel = other.cancel;
  Admit(std::move(other));
  while (!loop_->RestUntil_us()) loop_->RunRound();
  EXPECT_EQ(loop_->RunRound(), std::nullopt) << "no batch";
  EXPECT_LE(*loop_->RestUntil_us() - clock_.NowUs(), DeviceLoop::kLook_us);
  EXPECT_GT(*loop_->RestUntil_us(), clock_.NowUs());
  cancel.Cancel();
  loop_->RunRound();
  EXPECT_EQ(ended_, std::vector<std::string>{"other"});
  const auto batches = device_->batches().size();
  while (loop_->has_requests()) {
    if (const auto rest_us = loop_->RestUntil_us()) clock_.AdvanceUs(*rest_us - clock_.NowUs());
    loop_->RunRound();
  }
  EXPECT_TRUE(outcomes_["first"].status.ok());
  EXPECT_TRUE(outcomes_["behind"].status.ok());
  EXPECT_GT(device_->batches().size(), batches);
}

TEST_F(RateOfLoop, WhatCannotBeginBeforeItsDeadlineFailsAtOnceAndSaysWhenItCould) {
  const auto cloth = Cloth();
  rates_.Set({.per_tenant = 10 * kStep});
  Admit(WorkOf("slow", "debt", cloth, 31));  // 11 steps, then there is a debt
  while (!loop_->RestUntil_us()) loop_->RunRound();
  StepWork late = WorkOf("slow", "late", Cloth(), 1);
  late.deadline_us = rates_.WaitUntil_us("slow") - 1;
  StepWork patient = WorkOf("slow", "patient", Cloth(), 1);
  patient.deadline_us = rates_.WaitUntil_us("slow") + kSecond_us;
  const size_t batches = device_->batches().size();
  Admit(std::move(late));
  Admit(std::move(patient));
  loop_->RunRound();
  ASSERT_EQ(ended_, std::vector<std::string>{"late"});
  const Status& status = outcomes_["late"].status;
  EXPECT_EQ(status.reason(), "RATE_EXCEEDED");
  ASSERT_TRUE(status.retry_after_ms().has_value());
  EXPECT_GE(*status.retry_after_ms() * 1000, rates_.WaitUntil_us("slow") - clock_.NowUs());
  EXPECT_EQ(device_->batches().size(), batches) << "it cost no device time";
  clock_.AdvanceUs(rates_.WaitUntil_us("slow") - clock_.NowUs());
  loop_->RunRound();
  EXPECT_TRUE(outcomes_.at("patient").status.ok());
}

TEST_F(RateOfLoop, WhatIsFaultedCostsNothing) {
  const auto cloth = Cloth();
  rates_.Set({.per_tenant = 1e9});
  device_->FaultNextStep(cloth->handle());
  Admit(WorkOf("a", "fault", cloth, 1));
  RunAll();
  ASSERT_TRUE(cloth->is_faulted());
  const double before = rates_.Uses()[0].work;
  StepWork report = WorkOf("a", "report", cloth, 1);
  report.report = true;
  Admit(std::move(report));
  RunAll();
  EXPECT_EQ(rates_.Uses()[0].work, before);
}

TEST_F(RateOfLoop, ALongStepThatHasBegunGoesOn) {
  const auto heavy = Cloth();
  TakeFor({heavy}, kSecond_us);
  Admit(WorkOf("a", "heavy", heavy, 1));
  RunAll();
  device_->StepInPieces(5);
  Admit(WorkOf("a", "heavy", heavy, 1));
  loop_->RunRound();
  ASSERT_EQ(device_->under_way(), 1u);
  rates_.Set({.per_tenant = 1});
  rates_.Charge("a", 1000);
  RunAll();
  EXPECT_EQ(heavy->now().completed_steps, 2u);
}

TEST_F(RateOfLoop, ALongStepThatIsGivenUpCostsAsIfItWereDone) {
  const auto heavy = Cloth();
  TakeFor({heavy}, kSecond_us);
  Admit(WorkOf("a", "heavy", heavy, 1));
  RunAll();
  const double of_one_step = rates_.Uses()[0].work;
  device_->StepInPieces(1000);
  StepWork work = WorkOf("a", "heavy", heavy, 1);
  CancelToken token = work.cancel;
  Admit(std::move(work));
  loop_->RunRound();
  token.Cancel();
  loop_->RunRound();
  ASSERT_EQ(device_->abandoned(), 1u);
  EXPECT_EQ(rates_.Uses()[0].work, 2 * of_one_step);
}

// The device thread sleeps and wakes by itself; nobody spins, and a drain does not hang.
class RateOfScheduler : public SchedulerTest {
 protected:
  Awaited<StepOutcome> SubmitFor(const std::string& tenant, uint32_t steps) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = work.tenant = tenant;
    work.cloths = {Cloth()};
    work.steps = steps;
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return outcome;
  }
};

TEST_F(RateOfScheduler, TheDeviceThreadSleepsUntilTheDebtIsPaid) {
  Start({.max_queue_delay_us = 0});
  scheduler_->rates().Set({.per_tenant = 0, .of_tenant = {{"slow", 10 * kStep}}});
  const auto slow = SubmitFor("slow", 40);
  for (int k = 0; k < 20; ++k) EXPECT_TRUE(SubmitFor("quick", 3).Get().status.ok());
  EXPECT_FALSE(slow.has_value());
  const uint64_t rounds = scheduler_->counters().rounds;
  EXPECT_LE(rounds, 20u * 3 + 11);
  const std::clock_t busy = std::clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_LT(std::clock() - busy, CLOCKS_PER_SEC / 10) << "it spins";
  while (!slow.has_value()) {
    clock_.AdvanceUs(kSecond_us / 10);
    EXPECT_TRUE(SubmitFor("quick", 1).Get().status.ok());
  }
  EXPECT_TRUE(slow.Get().status.ok());
}

TEST_F(RateOfScheduler, ADrainEndsWhatIsHeldBackAfterTheGrace) {
  Start();
  scheduler_->rates().Set({.per_tenant = 1});
  const auto slow = SubmitFor("slow", 1000);
  scheduler_->Drain(0);
  EXPECT_EQ(slow.Get().status.reason(), "DRAINING");
}

}  // namespace
}  // namespace drape
