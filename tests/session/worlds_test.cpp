// Cloths that touch each other, on a real backend.
#include <gtest/gtest.h>

#include "server/core/clock.h"
#include "server/session/session_registry.h"
#include "tests/session/cpu_scheduler.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

// A square of 0.3 m at a height, in a world.
ClothCreation Sheet(const std::string& world, double height_m, uint32_t side = 7) {
  ClothCreation creation;
  ModelDescription description;
  description.topology = GridTopology{side, side, 0.3, 0.3};
  creation.description = std::make_shared<const ModelDescription>(std::move(description));
  creation.model = SceneModel::Build(*creation.description).value();
  creation.world = world;
  ClothCopy copy;
  copy.transform.position_m = {0.01 * side, height_m, 0};
  copy.parameters.settings = PresetSettings(Preset::kRealtime);
  copy.parameters.settings.substeps = 12;
  copy.parameters.thickness_m = 0.004;
  copy.parameters.friction_static = copy.parameters.friction_dynamic = 0.3;
  copy.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  creation.copies = {copy};
  return creation;
}

class SessionWorlds : public testing::Test {
 protected:
  ~SessionWorlds() override {
    scheduler_->Drain(0);
    session_ = {};
  }

  Result<CreatedCloths> TryCreate(Session& session, ClothCreation creation) {
    Awaited<Result<CreatedCloths>> created;
    session.CreateCloths(std::move(creation),
                         [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
    return created.Get();
  }
  ClothId Create(ClothCreation creation) {
    return TryCreate(*session_, std::move(creation)).value().ids.at(0);
  }
  ClothList Find(const std::vector<ClothId>& ids) { return session_->FindCloths(ids).value(); }

  StepOutcome Step(Session& session, const ClothList& cloths, uint32_t steps) {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session.name();
    for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
    work.steps = steps;
    work.report = true;
    work.view = {true, true};
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return outcome.Get();
  }
  StepOutcome Step(const ClothList& cloths, uint32_t steps = 1) {
    return Step(*session_, cloths, steps);
  }
  Status Update(const ClothList& cloths, const ClothChange& change) {
    Awaited<Result<UpdatedCloths>> done;
    session_->UpdateCloths(cloths, change,
                           [done](Result<UpdatedCloths> r) mutable { done.Set(std::move(r)); });
    const Result<UpdatedCloths> result = done.Get();
    return result.ok() ? Status::Ok() : result.status();
  }
  Status Save(const ClothList& cloths, const std::string& name) {
    Awaited<Status> done;
    session_->SaveStates(cloths, name, [done](const Result<SavedSummary>& r) mutable {
      done.Set(r.ok() ? Status::Ok() : r.status());
    });
    return done.Get();
  }
  Status Load(const std::string& name) {
    Awaited<Status> done;
    session_->LoadStates(name, {}, {}, [done](const Status& s) mutable { done.Set(s); });
    return done.Get();
  }

  SteadyClock clock_;
  std::unique_ptr<Scheduler> scheduler_ = StartCpuScheduler(clock_);
  SessionRegistry registry_{*scheduler_, {}, clock_, "test"};
  SessionLease session_ = registry_.Create(std::nullopt, "").value();
};

const std::vector<float>& Positions(const StepOutcome& outcome) {
  return std::get<std::vector<float>>(outcome.states->positions_m);
}

TEST_F(SessionWorlds, SheetsOfOneWorldRestOnEachOtherWhateverOrderNamesThem) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.02)), Create(Sheet("heap", 0.05, 8))});
  const StepOutcome end = Step({cloths[1], cloths[0]}, 120);
  ASSERT_TRUE(end.status.ok()) << end.status.ToString();
  EXPECT_NEAR(end.cloths[1].report->measured.lowest_m, 0.004, 0.0002);
  EXPECT_NEAR(end.cloths[0].report->measured.lowest_m, 0.008, 0.0004);
  for (const ClothOutcome& cloth : end.cloths) {
    EXPECT_GT(cloth.report->measured.near_pairs, 20u);
    EXPECT_EQ(cloth.report->measured.crossings, 0u);
  }
}

TEST_F(SessionWorlds, SheetsOfOtherWorldsPassThroughEachOther) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.02)), Create(Sheet("other", 0.05, 8))});
  const StepOutcome end = Step(cloths, 120);
  EXPECT_NEAR(end.cloths[1].report->measured.lowest_m, 0.004, 0.0002);
}

TEST_F(SessionWorlds, OnlyTheWholeWorldIsStepped) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.02)), Create(Sheet("heap", 0.05))});
  const Status status = Step({cloths[0]}).status;
  EXPECT_EQ(status.reason(), "WORLD_INCOMPLETE");
  EXPECT_NE(status.message().find(std::to_string(cloths[1]->id.Packed())), std::string::npos);
  EXPECT_EQ(cloths[0]->runtime->progress().completed_steps, 0u);
}

TEST_F(SessionWorlds, TheirSurfacesCountAmongTheStatesUntilTheirClothsAreDeleted) {
  SessionLimits limits;
  limits.max_state_bytes = StateBytes({.cloths = 2, .particles = 98, .world_particles = 49});
  SessionRegistry registry(*scheduler_, limits, clock_, "narrow");
  SessionLease narrow = registry.Create(std::nullopt, "").value();
  for (const char* const world : {"heap", "other heap"}) {
    const auto in_world = TryCreate(*narrow, Sheet(world, 0.02));
    ASSERT_TRUE(in_world.ok()) << in_world.status().ToString();
    const auto refused = TryCreate(*narrow, Sheet(world, 0.05));
    EXPECT_EQ(refused.status().reason(), "QUOTA_EXCEEDED");
    const auto apart = TryCreate(*narrow, Sheet("", 0.05));
    ASSERT_TRUE(apart.ok()) << apart.status().ToString();
    Awaited<Status> deleted;
    narrow->DeleteCloths(narrow->FindCloths({}).value(),
                         [deleted](const Status& s) mutable { deleted.Set(s); });
    ASSERT_TRUE(deleted.Get().ok());
  }
}

TEST_F(SessionWorlds, MembersHaveTheSameSettings) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.02)), Create(Sheet("heap", 0.05))});
  ClothCreation finer = Sheet("heap", 0.1);
  finer.copies[0].parameters.settings.substeps = 13;
  const Result<CreatedCloths> refused = TryCreate(*session_, finer);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.status().violations().at(0).field, "spec.settings.substeps");
  ClothChange change;
  change.settings = finer.copies[0].parameters.settings;
  const Status status = Update({cloths[1]}, change);
  EXPECT_EQ(status.violations().at(0).field, "spec.settings");
  EXPECT_TRUE(Update(cloths, change).ok());
  EXPECT_TRUE(TryCreate(*session_, finer).ok());
}

TEST_F(SessionWorlds, ChainsAndTooManyAreRefused) {
  ClothCreation chain = Chains(1, 3);
  chain.world = "heap";
  EXPECT_EQ(TryCreate(*session_, chain).status().violations().at(0).field, "world");
  ClothCreation many = Sheet("heap", 0.1, 2);
  many.copies.assign(kMaxClothsPerWorld + 1, many.copies[0]);
  EXPECT_EQ(TryCreate(*session_, many).status().reason(), "QUOTA_EXCEEDED");
}

TEST_F(SessionWorlds, AWorldIsGoneWithItsLastCloth) {
  const ClothList first = Find({Create(Sheet("heap", 0.02))});
  Awaited<Status> deleted;
  session_->DeleteCloths(first, [deleted](const Status& s) mutable { deleted.Set(s); });
  ASSERT_TRUE(deleted.Get().ok());
  ClothCreation other = Sheet("heap", 0.02);
  other.copies[0].parameters.settings.substeps = 20;
  EXPECT_TRUE(TryCreate(*session_, other).ok()) << "other settings than the first had";
}

// The states go on with the same bits, in the session and in another one.
TEST_F(SessionWorlds, SavedWorldsGoOnWithTheSameBits) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.01)), Create(Sheet("heap", 0.03, 8))});
  Step(cloths, 20);
  ASSERT_TRUE(Save(cloths, "middle").ok());
  const std::vector<float> expected = Positions(Step(cloths, 20));
  ASSERT_TRUE(Load("middle").ok());
  EXPECT_EQ(Positions(Step(cloths, 20)), expected);

  const auto import_into = [&](Session& session) {
    Awaited<Result<std::vector<ClothId>>> ids;
    session.ImportCloths(session_->FindSaved("middle")->cloths,
                         [ids](Result<std::vector<ClothId>> r) mutable { ids.Set(std::move(r)); });
    return ids.Get();
  };
  const Result<std::vector<ClothId>> refused = import_into(*session_);
  ASSERT_FALSE(refused.ok()) << "they would meet those that are there";
  EXPECT_EQ(refused.status().violations().at(0).field, "world");
  const SessionLease other = registry_.Create(std::nullopt, "").value();
  const Result<std::vector<ClothId>> ids = import_into(*other);
  ASSERT_TRUE(ids.ok()) << ids.status().ToString();
  const ClothList copies = other->FindCloths(*ids).value();
  EXPECT_EQ(Step(*other, {copies[0]}, 1).status.reason(), "WORLD_INCOMPLETE");
  EXPECT_EQ(Positions(Step(*other, copies, 20)), expected);
}

TEST_F(SessionWorlds, StatesOfOtherSettingsAreNotLoaded) {
  const ClothList cloths = Find({Create(Sheet("heap", 0.01)), Create(Sheet("heap", 0.03))});
  ASSERT_TRUE(Save(cloths, "middle").ok());
  ClothChange change;
  change.settings = cloths[0]->description()->parameters.settings;
  change.settings->substeps = 30;
  ASSERT_TRUE(Update(cloths, change).ok());
  EXPECT_EQ(Load("middle").violations().at(0).field, "cloth_ids[0]");
}

}  // namespace
}  // namespace drape
