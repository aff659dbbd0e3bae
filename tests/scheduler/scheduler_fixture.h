// A scheduler with a fake device and a fake clock.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"
#include "tests/scheduler/fake_backend.h"

namespace drape {

class SchedulerTest : public testing::Test {
 protected:
  void Start(const SchedulerLimits& limits = {}) {
    scheduler_ = Scheduler::Start(FakeBackendFactory(device_), limits, clock_).value();
  }

  ~SchedulerTest() override {
    scheduler_.reset();
    EXPECT_EQ(device_->calls_on_wrong_thread(), 0u);
  }

  std::shared_ptr<ClothRuntime> Cloth() {
    std::shared_ptr<ClothRuntime> cloth;
    EXPECT_TRUE(scheduler_
                    ->RunBlocking([&](Backend& backend) {
                      cloth = BeginCloth(backend, ChainModel(2));
                      return Status::Ok();
                    })
                    .ok());
    return cloth;
  }

  // Submits and returns the place for the outcome.
  Awaited<StepOutcome> Submit(const std::string& session,
                              std::vector<std::shared_ptr<ClothRuntime>> cloths, uint32_t steps = 1,
                              const CancelToken& cancel = {}) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session;
    work.cloths = std::move(cloths);
    work.steps = steps;
    work.cancel = cancel;
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    const Status status = scheduler_->Submit(std::move(work));
    EXPECT_TRUE(status.ok()) << status.ToString();
    return outcome;
  }

  Status TrySubmit(const std::string& session, const std::shared_ptr<ClothRuntime>& cloth,
                   const std::string& tenant = "") {
    StepWork work;
    work.tenant = tenant;
    work.session = session;
    work.cloths = {cloth};
    work.steps = 1;
    work.done = [](const StepOutcome&) {};
    return scheduler_->Submit(std::move(work));
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeClock clock_;
  std::unique_ptr<Scheduler> scheduler_;
};

}  // namespace drape
