// A scheduler on a fake backend, a registry and what to put into it, for tests of sessions.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/session/session_registry.h"
#include "tests/scheduler/fake_backend.h"

namespace drape {

// `copies` chains, each in an environment of its own 10 m further along +x.
inline ClothCreation Chains(size_t copies, uint32_t particles, const std::vector<Pin>& pins = {}) {
  ClothCreation creation;
  std::vector<uint32_t> pinned;
  for (const Pin& pin : pins) pinned.push_back(pin.particle);
  creation.description =
      std::make_shared<const ModelDescription>(ChainDescription(particles, pinned));
  creation.model = SceneModel::Build(*creation.description).value();
  creation.pins = pins;
  for (size_t k = 0; k < copies; ++k) {
    ClothCopy copy;
    copy.environment_origin_m = {10.0 * static_cast<double>(k), 0, 0};
    copy.parameters.settings.time_step_s = 0.25;
    creation.copies.push_back(copy);
  }
  return creation;
}

class SessionFixture : public testing::Test {
 protected:
  void Start(const SessionLimits& limits = {}) {
    scheduler_ = Scheduler::Start(FakeBackendFactory(device_), {}, clock_).value();
    registry_ = std::make_unique<SessionRegistry>(*scheduler_, limits, clock_, "server7");
    lease_ = registry_->Create(std::nullopt, "test").value();
  }

  ~SessionFixture() override {
    if (scheduler_ != nullptr) scheduler_->Drain(0);
    lease_ = {};
    registry_.reset();
    scheduler_.reset();
    EXPECT_EQ(device_->calls_on_wrong_thread(), 0u);
  }

  Session& session() { return *lease_; }

  static Result<CreatedCloths> Create(Session& session, ClothCreation creation) {
    Awaited<Result<CreatedCloths>> created;
    session.CreateCloths(std::move(creation),
                         [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
    return created.Get();
  }
  Result<CreatedCloths> Create(ClothCreation creation) {
    return Create(session(), std::move(creation));
  }
  // One chain, unpinned.
  std::shared_ptr<ClothRecord> CreateOne(uint32_t particles = 2) {
    return Find({Create(Chains(1, particles)).value().ids[0]})[0];
  }
  ClothList Find(const std::vector<ClothId>& ids) { return session().FindCloths(ids).value(); }

  Status Delete(ClothList cloths) {
    Awaited<Status> done;
    session().DeleteCloths(std::move(cloths), [done](const Status& s) mutable { done.Set(s); });
    return done.Get();
  }
  Status Reset(ClothList cloths) {
    Awaited<Status> done;
    session().ResetCloths(std::move(cloths), [done](const Status& s) mutable { done.Set(s); });
    return done.Get();
  }
  Awaited<Result<UpdatedCloths>> BeginUpdate(ClothList cloths, ClothChange change,
                                             const ModelRules& rules = {}) {
    Awaited<Result<UpdatedCloths>> done;
    session().UpdateCloths(
        std::move(cloths), std::move(change),
        [done](Result<UpdatedCloths> r) mutable { done.Set(std::move(r)); }, rules);
    return done;
  }
  Result<UpdatedCloths> Update(ClothList cloths, ClothChange change) {
    return BeginUpdate(std::move(cloths), std::move(change)).Get();
  }
  Awaited<StepOutcome> BeginStep(const ClothList& cloths, uint32_t steps) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session().name();
    for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
    work.steps = steps;
    work.report = true;
    work.view = {true, false};
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return outcome;
  }
  StepOutcome Step(const ClothList& cloths, uint32_t steps) {
    const auto outcome = BeginStep(cloths, steps);
    return std::move(outcome.Get());
  }
  // Looks into the backend, on the device thread.
  void Inspect(const std::function<void(const FakeBackend&)>& look) {
    EXPECT_TRUE(scheduler_
                    ->RunBlocking([&](Backend& backend) {
                      look(static_cast<const FakeBackend&>(backend));
                      return Status::Ok();
                    })
                    .ok());
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeClock clock_;
  std::unique_ptr<Scheduler> scheduler_;
  std::unique_ptr<SessionRegistry> registry_;
  SessionLease lease_;
};

}  // namespace drape
