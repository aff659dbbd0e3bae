#include "server/session/model_change.h"

#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

class ModelChangeTest : public SessionFixture {
 protected:
  ModelChangeTest() { Start(); }

  ClothList CreateChains(size_t copies, uint32_t particles, const std::vector<Pin>& pins = {}) {
    return Find(Create(Chains(copies, particles, pins)).value().ids);
  }

  static ClothChange Constraints(std::vector<DistanceConstraint> constraints) {
    ClothChange change;
    change.model.distance_constraints = std::move(constraints);
    return change;
  }
};

TEST_F(ModelChangeTest, OtherConstraintsKeepStateAndPins) {
  const ClothList cloths = CreateChains(2, 3, {{0, std::nullopt}});
  Step(cloths, 2);
  const auto updated = Update({cloths[0]}, Constraints({{0, 2, kRestShapeLength, 0}})).value();
  EXPECT_EQ(updated.model->constraint_count(), 1u);
  EXPECT_EQ(updated.model->constraints()[0].rest_length_m, 2) << "the distance in the rest shape";
  EXPECT_EQ(updated.model->pin_count(), 1u);
  EXPECT_EQ(cloths[1]->description()->model->constraint_count(), 2u);
  Inspect([&](const FakeBackend& backend) {
    const ClothHandle handle = cloths[0]->runtime->handle();
    EXPECT_EQ(backend.ModelOf(handle), updated.model);
    EXPECT_EQ(backend.StateOf(handle).positions_m[2], Vector3d(1, -2, 0));
    EXPECT_EQ(backend.PinTargetsOf(handle), (std::vector<Vector3d>{{-1, 0, 0}}));
  });
  EXPECT_EQ(Step(cloths, 1).cloths[0].stamp.completed_steps, 3u);
}

TEST_F(ModelChangeTest, ClothsOfOneDescriptionShareTheNewModel) {
  const ClothList cloths = CreateChains(2, 3);
  EXPECT_TRUE(Update(cloths, Constraints({{0, 1, 1, 0}})).ok());
  EXPECT_EQ(cloths[0]->description()->model, cloths[1]->description()->model);
}

TEST_F(ModelChangeTest, AFailureInTheMiddleTakesEverythingBack) {
  const ClothList cloths = CreateChains(3, 3);
  device_->FailWrite(1);
  EXPECT_EQ(Update(cloths, Constraints({})).status().code(), StatusCode::kResourceExhausted);
  Inspect([&](const FakeBackend& backend) {
    for (const auto& cloth : cloths) {
      EXPECT_EQ(backend.ModelOf(cloth->runtime->handle())->constraint_count(), 2u);
    }
  });
  for (const auto& cloth : cloths) {
    EXPECT_EQ(cloth->description()->model->constraint_count(), 2u);
  }
}

TEST_F(ModelChangeTest, WhatIsIllegalIsNamed) {
  const ClothList cloths = CreateChains(1, 3);
  const auto field_of = [&](const ClothChange& change) {
    const Status status = Update(cloths, change).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.violations().empty() ? "" : status.violations()[0].field;
  };
  EXPECT_EQ(field_of(Constraints({{0, 3, 1, 0}})), "spec.particles.distance_constraints[0].j");
  ClothChange joints;
  joints.model.point_joints = std::vector<PointJoint>{{1, 1, 0}};
  EXPECT_EQ(field_of(joints), "spec.particles.point_joints[0].j");
  ClothChange bending;
  bending.model.material.Set(&StructuralMaterial::bending_stiffness_n_per_m, 1);
  EXPECT_EQ(field_of(bending), "spec.material.bending_stiffness_n_per_m");
  EXPECT_EQ(cloths[0]->description()->model->constraint_count(), 2u);
}

TEST_F(ModelChangeTest, TheRulesOfTheCallerCount) {
  const ClothList cloths = CreateChains(1, 3);
  ModelCache models(uint64_t{1} << 30);
  ModelRules rules;
  rules.limits.max_degree = 1;
  const auto change = Constraints({{0, 1, 1, 0}, {1, 2, 1, 0}});
  EXPECT_EQ(BuildChangedModels(cloths, change, rules, "a", models).status().code(),
            StatusCode::kInvalidArgument);
  rules.limits = {};
  EXPECT_TRUE(BuildChangedModels(cloths, change, rules, "a", models).ok());
  rules.accept = [](const ClothDescription& before, const SceneModel& after) {
    EXPECT_EQ(before.model->constraint_count(), after.constraint_count());
    return Status::InvalidField("spec.settings", "too long");
  };
  EXPECT_EQ(BuildChangedModels(cloths, change, rules, "a", models).status().violations()[0].field,
            "spec.settings");
}

// Driven lengths continue under other pins and materials, and end with other constraints.
TEST_F(ModelChangeTest, DrivenLengthsOutliveOtherPins) {
  const ClothList cloths = CreateChains(1, 3);
  StepWork work;
  work.session = "a";
  work.cloths = {cloths[0]->runtime};
  work.steps = 2;  // 0.5 s of 1 s
  work.controls.lengths = {{0, {1, 3, 1}}};
  Awaited<bool> moved;
  work.done = [moved](const StepOutcome&) mutable { moved.Set(true); };
  ASSERT_TRUE(scheduler_->Submit(std::move(work)).ok());
  moved.Get();
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.LengthsOf(cloths[0]->runtime->handle()), (std::vector<double>{1, 2}));
  });
  ClothChange pins;
  pins.pins = std::vector<Pin>{{0, std::nullopt}, {1, std::nullopt}};
  EXPECT_TRUE(Update(cloths, pins).ok());
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.LengthsOf(cloths[0]->runtime->handle()), (std::vector<double>{2}));
  });
  Step(cloths, 2);
  Inspect([&](const FakeBackend& backend) {
    EXPECT_EQ(backend.LengthsOf(cloths[0]->runtime->handle()), (std::vector<double>{3}));
  });
  EXPECT_TRUE(Update(cloths, Constraints({{0, 2, 2, 0}})).ok());
  Inspect([&](const FakeBackend& backend) {
    EXPECT_TRUE(backend.LengthsOf(cloths[0]->runtime->handle()).empty());
  });
}

}  // namespace
}  // namespace drape
