#include "server/session/cloth_update.h"

#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class ClothUpdateTest : public SessionFixture {
 protected:
  ClothUpdateTest() { Start(); }

  ClothList CreateChains(size_t copies, uint32_t particles, const std::vector<Pin>& pins = {}) {
    return Find(Create(Chains(copies, particles, pins)).value().ids);
  }
};

TEST_F(ClothUpdateTest, ParametersChangeWhileTheStateStays) {
  const ClothList cloths = CreateChains(2, 3);
  Step(cloths, 2);
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(0, 0, -1);
  change.colliders = std::vector<Collider>{SphereAt({1, 0, 0}, 2)};
  EXPECT_TRUE(Update(cloths, change).ok());
  Inspect([&](const FakeBackend& backend) {
    for (const auto& cloth : cloths) {
      const ClothParameters& parameters = backend.ParametersOf(cloth->runtime->handle());
      EXPECT_EQ(parameters.gravity_m_per_s2, Vector3d(0, 0, -1));
      // The cloth's origin is (1, 0, 0).
      EXPECT_EQ(parameters.colliders[0].pose.position_m, Vector3d(0, 0, 0));
      EXPECT_EQ(backend.StateOf(cloth->runtime->handle()).positions_m[0], Vector3d(-1, -2, 0));
    }
  });
  const auto description = cloths[1]->description();
  EXPECT_EQ(description->parameters.gravity_m_per_s2, Vector3d(0, 0, -1));
  EXPECT_EQ(description->parameters.colliders[0].pose.position_m, Vector3d(1, 0, 0));
  EXPECT_EQ(cloths[0]->runtime->progress().completed_steps, 2u);
}

TEST_F(ClothUpdateTest, NewGravityCountsInThePotentialEnergyOfReports) {
  const ClothList cloths = CreateChains(1, 3);  // origin (1, 0, 0), 3 kg
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(-10, 0, 0);
  EXPECT_TRUE(Update(cloths, change).ok());
  EXPECT_EQ(Step(cloths, 1).cloths[0].report->measured.potential_energy_j, 30);
}

TEST_F(ClothUpdateTest, ANewTimeStepCountsFromTheNextStepOn) {
  const ClothList cloths = CreateChains(1, 3);
  Step(cloths, 2);  // 0.5 s
  ClothChange change;
  change.settings = test::PlainSettings();
  change.settings->time_step_s = 1;
  EXPECT_TRUE(Update(cloths, change).ok());
  EXPECT_EQ(Step(cloths, 2).cloths[0].stamp.time_s, 2.5);
}

TEST_F(ClothUpdateTest, AFailureInTheMiddleTakesEverythingBack) {
  const ClothList cloths = CreateChains(3, 3, {{0, std::nullopt}});
  device_->FailWrite(1);
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(1, 1, 1);
  change.pins = std::vector<Pin>{{2, std::nullopt}};
  const auto updated = Update(cloths, change);
  EXPECT_EQ(updated.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(device_->writes(), 3u);  // one, the one that failed, one taken back
  Inspect([&](const FakeBackend& backend) {
    for (const auto& cloth : cloths) {
      const ClothHandle handle = cloth->runtime->handle();
      EXPECT_EQ(backend.ParametersOf(handle).gravity_m_per_s2, Vector3d(0, -9.81, 0));
      EXPECT_EQ(backend.ModelOf(handle), cloths[0]->description()->model);
      EXPECT_EQ(backend.PinTargetsOf(handle), (std::vector<Vector3d>{{-1, 0, 0}}));
    }
  });
  for (const auto& cloth : cloths) EXPECT_EQ(cloth->description()->pins[0].particle, 0u);
}

TEST_F(ClothUpdateTest, AClothThatCannotBeTakenBackIsDeletedAndTheOthersStay) {
  const ClothList cloths = CreateChains(3, 3);
  device_->FailWrite(2, 2);  // the third cloth's, and what takes the second one back
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(1, 1, 1);
  const Status status = Update(cloths, change).status();
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("1 of the cloths"), std::string::npos) << status.message();
  Inspect([&](const FakeBackend& backend) {
    for (const size_t k : {0, 2}) {
      EXPECT_EQ(backend.ParametersOf(cloths[k]->runtime->handle()).gravity_m_per_s2,
                Vector3d(0, -9.81, 0));
    }
  });
  EXPECT_EQ(device_->live_cloths(), 2u);
  EXPECT_EQ(session().cloth_count(), 2u);
  EXPECT_EQ(session().FindCloths(std::vector{cloths[1]->id}).status().reason(), "CLOTH_NOT_FOUND");
  EXPECT_TRUE(Step({cloths[0], cloths[2]}, 1).status.ok());
}

TEST_F(ClothUpdateTest, StepsOfAClothThatCannotBeTakenBackEnd) {
  const ClothList cloths = CreateChains(2, 3);
  Awaited<bool> is_running;
  device_->OnStep([is_running]() mutable { is_running.Set(true); });
  const auto outcome = BeginStep({cloths[0]}, 1000000);
  is_running.Get();
  device_->FailWrite(1, 2);
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(1, 1, 1);
  EXPECT_FALSE(Update(cloths, change).ok());
  EXPECT_EQ(outcome.Get().status.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(outcome.Get().status.reason(), "DEVICE_MEMORY");
}

TEST_F(ClothUpdateTest, WhatOneClothCannotTakeNoneGets) {
  const ClothList cloths = CreateChains(2, 3);
  ClothChange ready;
  ready.numbers.Set(&ClothParameters::friction_static, 0.5);
  EXPECT_TRUE(Update({cloths[0]}, ready).ok());
  ClothChange change;
  change.numbers.Set(&ClothParameters::friction_dynamic, 0.4);
  const auto updated = Update(cloths, change);
  EXPECT_EQ(updated.status().violations()[0].field, "spec.material.friction_dynamic");
  EXPECT_EQ(cloths[0]->description()->parameters.friction_dynamic, 0);
  EXPECT_TRUE(Update({cloths[0]}, change).ok());
}

TEST_F(ClothUpdateTest, ADeletedClothIsNotFoundAndTheOthersStay) {
  const ClothList cloths = CreateChains(2, 3);
  EXPECT_TRUE(Delete({cloths[1]}).ok());
  ClothChange change;
  change.numbers.Set(&ClothParameters::damping_per_s, 1);
  EXPECT_EQ(Update(cloths, change).status().reason(), "CLOTH_NOT_FOUND");
  EXPECT_EQ(cloths[0]->description()->parameters.damping_per_s, 0);
}

TEST_F(ClothUpdateTest, NewPinsStartWhereTheirParticlesAre) {
  const ClothList cloths = CreateChains(1, 3);
  Step(cloths, 2);
  ClothChange change;
  change.pins = std::vector<Pin>{{2, Vector3d(2, 5, 0)}, {0, std::nullopt}};
  const auto updated = Update(cloths, change).value();
  EXPECT_EQ(updated.plan, "pinned");
  EXPECT_EQ(updated.model->pin_count(), 2u);
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.PinTargetsOf(cloths[0]->runtime->handle()),
              (std::vector<Vector3d>{{-1, -2, 0}, {1, -2, 0}}));
  });
  const StepOutcome outcome = Step(cloths, 1);
  EXPECT_EQ(outcome.cloths[0].stamp.completed_steps, 3u);
  EXPECT_EQ(std::get<std::vector<double>>(outcome.states->positions_m),
            (std::vector<double>{-1, -2, 0, 0, -3, 0, 1, 5, 0}));
}

TEST_F(ClothUpdateTest, TheStatesOfAllClothsAreReadAtOnce) {
  const ClothList cloths = CreateChains(2, 3);
  Step({cloths[1]}, 2);
  const size_t reads_before = device_->reads().size();
  ClothChange change;
  change.pins = std::vector<Pin>{{2, std::nullopt}};
  EXPECT_TRUE(Update(cloths, change).ok());
  ASSERT_EQ(device_->reads().size(), reads_before + 1);
  EXPECT_EQ(device_->reads().back(), 2u);
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.PinTargetsOf(cloths[0]->runtime->handle()),
              (std::vector<Vector3d>{{1, 0, 0}}));
    EXPECT_EQ(backend.PinTargetsOf(cloths[1]->runtime->handle()),
              (std::vector<Vector3d>{{1, -2, 0}}));
  });
}

TEST_F(ClothUpdateTest, WhatWasCreatedUnderWiderLimitsCanBeRepinned) {
  // A star: one particle with more constraints than the default limit.
  const uint32_t arms = ModelLimits{}.max_degree + 1;
  ParticleTopology star;
  for (uint32_t p = 0; p <= arms; ++p) {
    star.positions_m.emplace_back(p, 0, 0);
    star.masses_kg.push_back(1);
    if (p > 0) star.distance_constraints.push_back({0, p, static_cast<double>(p), 0});
  }
  ModelDescription description;
  description.topology = std::move(star);
  ModelLimits limits;
  limits.max_degree = arms;
  ClothCreation creation = Chains(1, 2);
  creation.description = std::make_shared<const ModelDescription>(std::move(description));
  creation.model = SceneModel::Build(*creation.description, limits).value();
  const ClothList cloths = Find(Create(std::move(creation)).value().ids);
  ClothChange change;
  change.pins = std::vector<Pin>{{1, std::nullopt}};
  const auto updated = Update(cloths, change);
  ASSERT_TRUE(updated.ok()) << updated.status().ToString();
  EXPECT_EQ(updated->model->pin_count(), 1u);
}

TEST_F(ClothUpdateTest, PinsThatStayKeepTheirMotion) {
  const ClothList cloths = CreateChains(1, 3, {{0, std::nullopt}});
  StepWork work;
  work.session = "a";
  work.cloths = {cloths[0]->runtime};
  work.steps = 2;  // 0.5 s of 1 s
  work.controls.pins = {{0, {0, Vector3d(-1, 8, 0), 1}}};
  Awaited<bool> moved;
  work.done = [moved](const StepOutcome&) mutable { moved.Set(true); };
  ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
  moved.Get();
  ClothChange change;
  change.pins = std::vector<Pin>{{0, std::nullopt}, {1, std::nullopt}};
  EXPECT_TRUE(Update(cloths, change).ok());
  const auto positions = std::get<std::vector<double>>(Step(cloths, 1).states->positions_m);
  EXPECT_EQ(positions[1], 6);
  EXPECT_EQ(positions[4], -2);
}

TEST_F(ClothUpdateTest, RemovedPinsAreFree) {
  const ClothList cloths = CreateChains(1, 3, {{0, std::nullopt}});
  ClothChange change;
  change.pins = std::vector<Pin>{};
  EXPECT_EQ(Update(cloths, change).value().plan, "free");
  EXPECT_EQ(std::get<std::vector<double>>(Step(cloths, 1).states->positions_m)[1], -1);
  EXPECT_TRUE(Reset(cloths).ok());
  EXPECT_TRUE(Step(cloths, 1).status.ok());
}

TEST_F(ClothUpdateTest, ABadPinIsNamed) {
  const ClothList cloths = CreateChains(1, 3);
  ClothChange change;
  change.pins = std::vector<Pin>{{0, std::nullopt}, {3, std::nullopt}};
  const Status status = Update(cloths, change).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  ASSERT_FALSE(status.violations().empty());
  EXPECT_EQ(status.violations()[0].field, "spec.pins[1].particle");
}

TEST_F(ClothUpdateTest, ClothsOfOneDescriptionShareTheNewModel) {
  const ClothList cloths = CreateChains(2, 3);
  ClothChange change;
  change.pins = std::vector<Pin>{{1, std::nullopt}};
  EXPECT_TRUE(Update(cloths, change).ok());
  EXPECT_EQ(cloths[0]->description()->model, cloths[1]->description()->model);
}

// Both models are built from the same description; the one that comes second may not be applied.
TEST_F(ClothUpdateTest, AModelForADescriptionThatIsNoMoreIsRefused) {
  const ClothList cloths = CreateChains(2, 4, {{0, std::nullopt}});
  ClothChange pins;
  pins.pins = std::vector<Pin>{{0, std::nullopt}, {3, std::nullopt}};
  ClothChange material;
  material.model.distance_constraints =
      std::vector<DistanceConstraint>{{.i = 0, .j = 3, .rest_length_m = 1}};
  scheduler_->HoldForTest();
  const auto first = BeginUpdate(cloths, pins);
  const auto second = BeginUpdate({cloths[1]}, material);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(first.Get().ok());
  EXPECT_EQ(second.Get().status().reason(), kUpdateConflict);
  EXPECT_TRUE(second.Get().status().retry_after_ms().has_value());
  for (const auto& cloth : cloths) {
    EXPECT_EQ(cloth->description()->pins.size(), 2u);
    EXPECT_EQ(cloth->description()->model->pin_count(), 2u);
  }
  EXPECT_TRUE(Reset(cloths).ok());
  // Made again, it has both changes.
  EXPECT_TRUE(Update({cloths[1]}, material).ok());
  EXPECT_EQ(cloths[1]->description()->model->pin_count(), 2u);
  EXPECT_EQ(cloths[1]->description()->model->described_constraint_count(), 1u);
}

TEST_F(ClothUpdateTest, ChangesWithoutAModelNeverConflict) {
  const ClothList cloths = CreateChains(1, 4);
  ClothChange pins;
  pins.pins = std::vector<Pin>{{3, std::nullopt}};
  ClothChange gravity;
  gravity.gravity_m_per_s2 = Vector3d(0, 0, -1);
  scheduler_->HoldForTest();
  const auto first = BeginUpdate(cloths, gravity);
  const auto second = BeginUpdate(cloths, pins);
  const auto third = BeginUpdate(cloths, gravity);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(first.Get().ok());
  EXPECT_TRUE(second.Get().ok());
  EXPECT_TRUE(third.Get().ok());
}

// What was legal when it was asked for may not be when it is done.
TEST_F(ClothUpdateTest, TheRulesHoldForTheClothAsItIsThen) {
  const ClothList cloths = CreateChains(1, 4);
  ModelRules rules;
  rules.accept = [](const ClothDescription& before, const SceneModel&) -> Status {
    if (before.parameters.gravity_m_per_s2.z() == 0) return Status::Ok();
    return Status::InvalidField("spec.settings", "too much");
  };
  ClothChange gravity;
  gravity.gravity_m_per_s2 = Vector3d(0, 0, -1);
  ClothChange wind;
  wind.wind_m_per_s = Vector3d(1, 0, 0);
  scheduler_->HoldForTest();
  const auto first = BeginUpdate(cloths, gravity, rules);
  const auto second = BeginUpdate(cloths, wind, rules);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(first.Get().ok());
  EXPECT_EQ(second.Get().status().reason(), "INVALID_FIELDS");
}

TEST_F(ClothUpdateTest, OneThatNobodyWantsAnyMoreChangesNothing) {
  const ClothList cloths = CreateChains(2, 3);
  const auto before = cloths[0]->description();
  ClothChange change;
  change.pins = std::vector<Pin>{{0, std::nullopt}};
  for (const size_t last : {1u, 3u, 6u}) {
    size_t asked = 0;
    StopWhenUnwanted then([&] { return ++asked == last; });
    bool is_done = false;
    EXPECT_THROW(session().UpdateCloths(
                     cloths, change, [&](const auto&) { is_done = true; }, {}, {}, &then),
                 WorkStopped);
    EXPECT_FALSE(is_done);
    EXPECT_EQ(cloths[0]->description(), before);
  }
  EXPECT_TRUE(Update(cloths, change).ok());
  EXPECT_EQ(cloths[0]->description()->pins.size(), 1u);
}

}  // namespace
}  // namespace drape
