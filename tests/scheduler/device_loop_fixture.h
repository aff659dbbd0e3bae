// A device loop on the fake backend.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/device_loop.h"
#include "tests/scheduler/fake_backend.h"

namespace drape {

// Rounds by hand, on one thread.
class DeviceLoopTest : public testing::Test {
 protected:
  DeviceLoopTest() { Restart(16384); }

  void Restart(uint32_t max_cloths_per_batch, int64_t batch_budget_us = 50'000,
               uint64_t max_long_step_bytes = UINT64_MAX) {
    loop_.emplace(
        backend_,
        DeviceLoop::Settings{{max_cloths_per_batch, 1}, 1000, batch_budget_us, max_long_step_bytes},
        clock_,
        [this](StepWork work, StepOutcome outcome) {
          ended_.push_back(work.session);
          outcomes_[work.session] = std::move(outcome);
        },
        counters_, rates_);
  }

  std::shared_ptr<ClothRuntime> Cloth(std::vector<uint32_t> pinned = {}) {
    return BeginCloth(backend_, ChainModel(2, std::move(pinned)));
  }

  static StepWork Work(const std::string& name, std::vector<std::shared_ptr<ClothRuntime>> cloths,
                       uint32_t steps = 1) {
    StepWork work;
    work.session = name;
    work.cloths = std::move(cloths);
    work.steps = steps;
    return work;
  }

  void Admit(StepWork work) { loop_->Admit(std::move(work), clock_.NowUs()); }

  void RunAll() {
    while (loop_->has_requests()) loop_->RunRound();
  }

  // A batch with any of the cloths takes so long for each of them.
  void TakeFor(const std::vector<std::shared_ptr<ClothRuntime>>& cloths, int64_t each_us) {
    std::vector<ClothHandle> handles;
    for (const auto& cloth : cloths) handles.push_back(cloth->handle());
    device_->OnItem([this, handles, each_us](ClothHandle cloth) {
      if (std::find(handles.begin(), handles.end(), cloth) != handles.end()) {
        clock_.AdvanceUs(each_us);
      }
    });
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeBackend backend_{device_};
  FakeClock clock_;
  RoundCounters counters_;
  RateQuota rates_{clock_};
  std::optional<DeviceLoop> loop_;
  std::vector<std::string> ended_;
  std::map<std::string, StepOutcome> outcomes_;
};

}  // namespace drape
