#include "server/session/session.h"

#include <gtest/gtest.h>

#include <set>

#include "server/session/sliced_command.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class SessionTest : public SessionFixture {};

TEST_F(SessionTest, ThousandsOfClothsInOneCall) {
  Start();
  const auto created = Create(Chains(4000, 3)).value();
  ASSERT_EQ(created.ids.size(), 4000u);
  std::set<uint64_t> ids;
  for (const ClothId id : created.ids) ids.insert(id.Packed());
  EXPECT_EQ(ids.size(), 4000u);
  EXPECT_EQ(device_->live_cloths(), 4000u);
  EXPECT_EQ(session().cloth_count(), 4000u);
  EXPECT_EQ(session().particle_count(), 12000u);
  EXPECT_EQ(created.plan, "free");
  EXPECT_EQ(created.model->particle_count(), 3u);
}

TEST_F(SessionTest, LargeCreationsLetTheStepsOfOthersThrough) {
  Start();
  const auto mine = CreateOne();
  scheduler_->HoldForTest();
  // Three slices of one cloth each.
  Awaited<Result<CreatedCloths>> created;
  session().CreateCloths(Chains(3, kSliceParticles),
                         [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
  size_t cloths_at_first_step = 0;
  device_->OnStep([&] {
    if (cloths_at_first_step == 0) cloths_at_first_step = device_->live_cloths();
  });
  const auto outcome = BeginStep({mine}, 1);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(outcome.Get().status.ok());
  EXPECT_TRUE(created.Get().ok());
  EXPECT_EQ(cloths_at_first_step, 2u);
}

// However few particles they have.
TEST_F(SessionTest, CollidersAndDrivenLengthsMakeSlicesSmaller) {
  Start();
  ClothCreation creation = Chains(2, 2);
  creation.copies[1].parameters.colliders.assign(256, SphereAt({0, -9, 0}, 0.5));
  const ClothList cloths = Find(Create(std::move(creation)).value().ids);
  EXPECT_EQ(ClothsPerSlice(std::span(cloths).first(1)), kSliceCloths);
  EXPECT_EQ(ClothsPerSlice(cloths), 7u);
  cloths[0]->held_lengths.Hold(1u << 16, nullptr);
  EXPECT_EQ(ClothsPerSlice(std::span(cloths).first(1)), 1u);
}

TEST_F(SessionTest, AllOrNothingWhenTheDeviceIsFull) {
  Start();
  const auto before = CreateOne();
  device_->SetCapacity(6);
  const auto created = Create(Chains(10, 3));
  EXPECT_EQ(created.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(device_->live_cloths(), 1u);
  EXPECT_EQ(session().cloth_count(), 1u);
  EXPECT_EQ(session().particle_count(), 2u);
  EXPECT_EQ(session().FindCloths({}).value(), ClothList{before});
  EXPECT_TRUE(Create(Chains(5, 3)).ok());  // the room is still there
}

TEST_F(SessionTest, QuotasAreNamedAndGivenBack) {
  SessionLimits limits;
  limits.max_cloths_per_session = 5;
  limits.max_particles_per_session = 20;
  Start(limits);
  const auto first = Create(Chains(3, 2)).value();
  const Status cloths = Create(Chains(3, 2)).status();
  EXPECT_EQ(cloths.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(cloths.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(cloths.message().find("max_cloths_per_session is 5"), std::string::npos);
  const Status particles = Create(Chains(1, 15)).status();
  EXPECT_EQ(particles.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(particles.message().find("max_particles_per_session is 20"), std::string::npos);
  EXPECT_TRUE(Delete(Find(first.ids)).ok());
  EXPECT_TRUE(Create(Chains(1, 20)).ok());
}

TEST_F(SessionTest, CheckClothsCreatesNothing) {
  SessionLimits limits;
  limits.max_cloths_per_session = 5;
  Start(limits);
  const auto check = [&](ClothCreation creation) {
    Awaited<Result<CreatedCloths>> checked;
    session().CheckCloths(std::move(creation), [checked](Result<CreatedCloths> r) mutable {
      checked.Set(std::move(r));
    });
    return checked.Get();
  };
  const auto fits = check(Chains(5, 2, {{0, std::nullopt}})).value();
  EXPECT_TRUE(fits.ids.empty());
  EXPECT_EQ(fits.plan, "pinned");
  EXPECT_EQ(fits.model->particle_count(), 2u);
  EXPECT_EQ(check(Chains(6, 2)).status().reason(), "QUOTA_EXCEEDED");
  EXPECT_EQ(device_->live_cloths(), 0u);
  EXPECT_EQ(session().cloth_count(), 0u);
}

TEST_F(SessionTest, EqualModelsAreOneOnTheDevice) {
  Start();
  const auto first = Create(Chains(2, 4)).value();
  const auto second = Create(Chains(1, 4)).value();
  EXPECT_EQ(first.model, second.model);
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.ModelOf(Find(second.ids)[0]->runtime->handle()), first.model);
  });
}

TEST_F(SessionTest, ClothsStartWhereTheirTransformPutsThem) {
  Start();
  ClothCreation creation = Chains(1, 3);  // centroid (1, 0, 0)
  creation.copies[0].transform.position_m = {0, 4, 0};
  creation.copies[0].parameters.colliders = {SphereAt({1, 4, 2}, 1)};
  const auto cloth = Find(Create(creation).value().ids)[0];
  EXPECT_EQ(cloth->placement.origin_in_environment_m, Vector3d(1, 4, 0));
  Inspect([&](const FakeBackend& backend) {
    const ClothHandle handle = cloth->runtime->handle();
    EXPECT_EQ(backend.StateOf(handle).positions_m,
              (std::vector<Vector3d>{{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}}));
    EXPECT_EQ(backend.ParametersOf(handle).colliders[0].pose.position_m, Vector3d(0, 0, 2));
  });
  // The record keeps what the client said.
  EXPECT_EQ(cloth->description()->parameters.colliders[0].pose.position_m, Vector3d(1, 4, 2));
}

TEST_F(SessionTest, PinsGoToTheirTargetsInTheFirstStep) {
  Start();
  // In any order; particle 2 without a target.
  const auto created = Create(Chains(1, 3, {{2, std::nullopt}, {0, Vector3d(0, 6, 0)}})).value();
  const auto cloth = Find(created.ids)[0];
  const StepOutcome outcome = Step({cloth}, 2);
  const auto batches = device_->batches();
  EXPECT_EQ(batches[0][0].pin_targets_m, (std::vector<Vector3d>{{-1, 6, 0}, {1, 0, 0}}));
  EXPECT_TRUE(batches[1][0].pin_targets_m.empty());
  EXPECT_EQ(std::get<std::vector<double>>(outcome.states->positions_m),
            (std::vector<double>{-1, 6, 0, 0, -2, 0, 1, 0, 0}));
}

TEST_F(SessionTest, ReportsAreInTheClientsFrames) {
  Start();
  ClothCreation creation = Chains(1, 2);
  creation.copies[0].transform.position_m = {0, 3, 0};
  creation.copies[0].environment_origin_m = {0, 100, 0};
  const StepOutcome outcome = Step(Find(Create(creation).value().ids), 1);
  // The fake backend measures 0 for both.
  EXPECT_EQ(outcome.cloths[0].report->measured.lowest_m, 103);
  EXPECT_EQ(outcome.cloths[0].report->measured.potential_energy_j, 2 * 9.81 * 3);
}

TEST_F(SessionTest, FindKeepsTheOrderAsked) {
  Start();
  const auto ids = Create(Chains(3, 2)).value().ids;
  const ClothList found = Find({ids[2], ids[0]});
  EXPECT_EQ(found[0]->id, ids[2]);
  EXPECT_EQ(found[1]->id, ids[0]);
  const ClothList all = session().FindCloths({}).value();
  ASSERT_EQ(all.size(), 3u);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(all[k]->id, ids[k]);
}

TEST_F(SessionTest, UnknownStaleAndForeignIdsGetTheSameAnswer) {
  Start();
  const auto other = registry_->Create(std::nullopt, "other").value();
  const ClothId foreign = Create(*other, Chains(1, 2)).value().ids[0];
  const auto mine = CreateOne();
  EXPECT_TRUE(Delete({mine}).ok());
  const auto next = CreateOne();  // in the slot of the deleted one
  EXPECT_EQ(next->id.slot, mine->id.slot);
  for (const ClothId id : {foreign, mine->id, ClothId{1000, 1}, ClothId{}}) {
    const std::vector<ClothId> ids{id};
    const Status status = session().FindCloths(ids).status();
    EXPECT_EQ(status.code(), StatusCode::kNotFound);
    EXPECT_EQ(status.reason(), "CLOTH_NOT_FOUND");
    EXPECT_EQ(status.message(), "no cloth " + std::to_string(id.Packed()) + " in this session");
  }
}

TEST_F(SessionTest, ARepeatedIdIsRefused) {
  Start();
  const ClothId id = CreateOne()->id;
  const std::vector<ClothId> ids{id, id};
  EXPECT_EQ(session().FindCloths(ids).status().violations()[0].field, "cloth_ids[1]");
}

TEST_F(SessionTest, ListsArePaged) {
  Start();
  const auto ids = Create(Chains(5, 2)).value().ids;
  std::vector<ClothId> seen;
  std::string token;
  do {
    const ClothPage page = session().ListCloths(2, token).value();
    EXPECT_LE(page.cloths.size(), 2u);
    for (const auto& cloth : page.cloths) seen.push_back(cloth->id);
    token = page.next_page_token;
  } while (!token.empty());
  EXPECT_EQ(seen, ids);
  EXPECT_EQ(session().ListCloths(2, "nonsense").status().violations()[0].field, "page_token");
}

TEST_F(SessionTest, DeletingDuringAStepEndsThatRequestAlone) {
  Start();
  const auto ids = Create(Chains(2, 2)).value().ids;
  const auto bad = Find({ids[0]}), good = Find({ids[1]});
  scheduler_->HoldForTest();
  const auto ends = BeginStep(bad, 1000000);
  const auto goes_on = BeginStep(good, 10);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(Delete(bad).ok());
  EXPECT_EQ(ends.Get().status.code(), StatusCode::kNotFound);
  EXPECT_EQ(ends.Get().status.reason(), "CLOTH_NOT_FOUND");
  EXPECT_TRUE(goes_on.Get().status.ok());
  EXPECT_EQ(good[0]->runtime->progress().completed_steps, 10u);
  EXPECT_EQ(device_->live_cloths(), 1u);
  EXPECT_EQ(session().cloth_count(), 1u);
}

TEST_F(SessionTest, DeletingTwiceFreesOnce) {
  Start();
  const auto cloth = CreateOne();
  EXPECT_TRUE(Delete({cloth}).ok());
  EXPECT_TRUE(Delete({cloth}).ok());
  EXPECT_EQ(device_->live_cloths(), 0u);
  EXPECT_EQ(session().cloth_count(), 0u);
}

// Pins and colliders of thousands of cloths would take gigabytes for a moment.
TEST_F(SessionTest, AClothEndsWithoutACopyOfItsDescription) {
  Start();
  const auto cloth = CreateOne();
  const auto description = cloth->description();
  EXPECT_NE(cloth->charges().model, nullptr);
  EXPECT_TRUE(Delete({cloth}).ok());
  EXPECT_EQ(cloth->description(), description);
  EXPECT_EQ(cloth->charges().model, nullptr) << "it counts no longer, though somebody holds it";
}

TEST_F(SessionTest, LargeDeletionsLetOthersThroughButNotTheirOwner) {
  Start();
  Create(Chains(3 * kSliceCloths, 2)).value();
  scheduler_->HoldForTest();
  Awaited<Status> done;
  session().DeleteCloths(Find({}), [done](const Status& s) mutable { done.Set(s); });
  const auto post = [&](const std::string& owner) {
    Awaited<size_t> left;
    const auto look = [this, left](Backend&) mutable { left.Set(device_->live_cloths()); };
    EXPECT_TRUE(scheduler_->Post(owner, look).ok());
    return left;
  };
  Awaited<size_t> left_for_other = post("other");
  Awaited<size_t> left_for_owner = post(session().owner());
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(done.Get().ok());
  EXPECT_EQ(session().cloth_count(), 0u);
  EXPECT_EQ(left_for_other.Get(), 2 * kSliceCloths);
  EXPECT_EQ(left_for_owner.Get(), 0u);
}

TEST_F(SessionTest, ResetBringsBackTheStateOfCreation) {
  Start();
  const auto cloth = Find(Create(Chains(1, 3, {{0, Vector3d(0, 2, 0)}})).value().ids)[0];
  const auto first = Step({cloth}, 3);
  device_->FaultNextStep(cloth->runtime->handle());
  EXPECT_EQ(Step({cloth}, 1).cloths[0].stamp.fault, FaultReason::kNotFinite);
  EXPECT_TRUE(Reset({cloth}).ok());
  const ClothProgress progress = cloth->runtime->progress();
  EXPECT_EQ(progress.completed_steps, 0u);
  EXPECT_EQ(progress.time_s, 0);
  EXPECT_EQ(progress.fault, FaultReason::kNone);
  EXPECT_EQ(progress.warnings, WarningCounters{});
  const auto second = Step({cloth}, 3);
  EXPECT_EQ(std::get<std::vector<double>>(first.states->positions_m),
            std::get<std::vector<double>>(second.states->positions_m));
}

TEST_F(SessionTest, ResetOfADeletedClothIsNotFound) {
  Start();
  const auto cloth = CreateOne();
  EXPECT_TRUE(Delete({cloth}).ok());
  EXPECT_EQ(Reset({cloth}).reason(), "CLOTH_NOT_FOUND");
  EXPECT_TRUE(Reset({}).ok());
}

TEST_F(SessionTest, AfterDrainEverythingIsRefusedOrFreed) {
  Start();
  const auto cloth = CreateOne();
  scheduler_->Drain(0);
  EXPECT_EQ(Create(Chains(1, 2)).status().reason(), "DRAINING");
  EXPECT_EQ(Update({cloth}, {}).status().reason(), "DRAINING");
  EXPECT_EQ(Reset({cloth}).reason(), "DRAINING");
  // Nobody may be told that a cloth is deleted which comes back with the last checkpoint.
  EXPECT_EQ(Delete({cloth}).reason(), "DRAINING");
  EXPECT_EQ(session().particle_count(), 2u);  // the creation that was refused holds nothing
}

}  // namespace
}  // namespace drape
