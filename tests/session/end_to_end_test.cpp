// Sessions and scheduler on a real backend.
#include <gtest/gtest.h>

#include <cmath>

#include "server/core/clock.h"
#include "server/session/session_registry.h"
#include "tests/scheduler/fake_backend.h"
#include "tests/session/cpu_scheduler.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

class EndToEnd : public testing::Test {
 protected:
  ~EndToEnd() override { scheduler_->Drain(0); }

  // Two environments at a distance of 1000 m: a free chain above the one, the same above the other.
  static ClothCreation FallingChains() {
    ClothCreation creation = Chains(2, 4);
    for (ClothCopy& copy : creation.copies) {
      copy.transform.position_m = {0, 50, 0};
      copy.parameters.settings.time_step_s = 1.0 / 64;
      copy.parameters.settings.substeps = 4;
    }
    creation.copies[1].environment_origin_m = {0, 1000, 0};
    return creation;
  }

  // Report of the first cloth, after `steps` steps.
  StepReport StepAndReport(const SessionLease& session, const ClothList& cloths, uint32_t steps) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session->name();
    for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
    work.steps = steps;
    work.report = true;
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return *outcome.Get().cloths.at(0).report;
  }

  SteadyClock clock_;
  std::unique_ptr<Scheduler> scheduler_ = StartCpuScheduler(clock_);
  SessionRegistry registry_{*scheduler_, {}, clock_, "test"};
};

TEST_F(EndToEnd, ClothsFallAsTheyShouldAndCopiesAgreeBitForBit) {
  const SessionLease session = registry_.Create(std::nullopt, "").value();
  Awaited<Result<CreatedCloths>> created;
  session->CreateCloths(FallingChains(),
                        [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
  const ClothList cloths = session->FindCloths(created.Get().value().ids).value();

  Awaited<StepOutcome> outcome;
  StepWork work;
  work.session = session->name();
  for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
  work.steps = 64;
  work.report = true;
  work.view = {true, true};
  work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
  ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());

  const StepOutcome& end = outcome.Get();
  ASSERT_TRUE(end.status.ok());
  EXPECT_EQ(end.cloths[0].stamp.time_s, 1);
  EXPECT_EQ(end.timing.batch_cloths, 2u);
  // Free fall has no error but rounding (server/solver/method.md): 256 additions of numbers up
  // to 9.81, each to half an ulp of single precision.
  const double fallen_m = 9.81 / 2;
  const double rounding = 256 * 9.81 * std::ldexp(1.0, -24);
  EXPECT_NEAR(end.cloths[0].report->measured.lowest_m, 50 - fallen_m, rounding);
  EXPECT_NEAR(end.cloths[1].report->measured.lowest_m, 1050 - fallen_m, rounding);
  // 4 kg; zero at the environment's origin, so the same for both.
  EXPECT_NEAR(end.cloths[0].report->measured.potential_energy_j, 4 * 9.81 * (50 - fallen_m),
              4 * 9.81 * rounding);
  EXPECT_EQ(end.cloths[0].report->measured.potential_energy_j,
            end.cloths[1].report->measured.potential_energy_j);
  const auto& positions = std::get<std::vector<float>>(end.states->positions_m);
  ASSERT_EQ(positions.size(), 24u);
  for (size_t k = 0; k < 12; ++k) EXPECT_EQ(positions[k], positions[k + 12]);

  // Reset and once more: the same bits.
  Awaited<Status> reset;
  session->ResetCloths(cloths, [reset](const Status& s) mutable { reset.Set(s); });
  ASSERT_TRUE(reset.Get().ok());
  Awaited<StepOutcome> again;
  StepWork repeat;
  repeat.session = session->name();
  repeat.cloths = {cloths[1]->runtime};
  repeat.until_step = 64;
  repeat.view = {true, false};
  repeat.done = [again](StepOutcome o) mutable { again.Set(std::move(o)); };
  ASSERT_TRUE(scheduler_->Submit(std::move(repeat)).ok());
  const auto& repeated = std::get<std::vector<float>>(again.Get().states->positions_m);
  EXPECT_EQ(repeated, std::vector<float>(positions.begin() + 12, positions.end()));
}

// A chain that falls onto the ground sleeps there, until its gravity changes or it is reset.
TEST_F(EndToEnd, ClothsAtRestSleepUntilSomethingChanges) {
  const SessionLease session = registry_.Create(std::nullopt, "").value();
  ClothCreation creation = Chains(1, 4);
  creation.copies[0].parameters.settings = PresetSettings(Preset::kRealtime);
  creation.copies[0].parameters.colliders = {
      PlaneThrough(Eigen::Vector3d(0, -0.1, 0), Eigen::Vector3d::UnitY())};
  Awaited<Result<CreatedCloths>> created;
  session->CreateCloths(std::move(creation),
                        [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
  const ClothList cloths = session->FindCloths(created.Get().value().ids).value();

  EXPECT_FALSE(StepAndReport(session, cloths, 10).is_asleep) << "still falling";
  const StepReport at_rest = StepAndReport(session, cloths, 290);
  EXPECT_TRUE(at_rest.is_asleep);
  EXPECT_NEAR(at_rest.measured.lowest_m, -0.1, 1e-6);

  const auto change_gravity = [&](const Eigen::Vector3d& gravity_m_per_s2) {
    ClothChange change;
    change.gravity_m_per_s2 = gravity_m_per_s2;
    Awaited<Status> changed;
    session->UpdateCloths(
        cloths, std::move(change),
        [changed](const Result<UpdatedCloths>& r) mutable { changed.Set(r.status()); });
    ASSERT_TRUE(changed.Get().ok());
  };
  change_gravity({0, 9.81, 0});
  const StepReport risen = StepAndReport(session, cloths, 30);
  EXPECT_FALSE(risen.is_asleep);
  // Half a second of it; contacts let go at once.
  EXPECT_NEAR(risen.measured.lowest_m, -0.1 + 9.81 / 8, 0.02);
  change_gravity({0, -9.81, 0});
  EXPECT_TRUE(StepAndReport(session, cloths, 600).is_asleep);

  Awaited<Status> reset;
  session->ResetCloths(cloths, [reset](const Status& s) mutable { reset.Set(s); });
  ASSERT_TRUE(reset.Get().ok());
  const StepReport anew = StepAndReport(session, cloths, 1);
  EXPECT_FALSE(anew.is_asleep);
  EXPECT_NEAR(anew.measured.lowest_m, -9.81 / 7200, 1e-4);
}

}  // namespace
}  // namespace drape
