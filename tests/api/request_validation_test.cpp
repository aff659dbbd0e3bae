#include "server/api/request_validation.h"

#include <ctime>

#include "server/api/material_message.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::BadCase;
using test::ExpectViolation;
using test::GoodCreation;
using test::GoodStep;
using test::kInfinity;
using test::kNaN;
using test::NameOf;
using test::Set;
using test::Spec;

constexpr uint32_t kMaxSteps = 1000;

using BadCreation = BadCase<v1::CreateClothsRequest>;
class CreateClothsValidation : public testing::TestWithParam<BadCreation> {};

TEST_P(CreateClothsValidation, NamesFieldValueAndRange) {
  v1::CreateClothsRequest request = GoodCreation();
  ASSERT_TRUE(CheckCreateCloths(request, {}).ok());
  GetParam().spoil(request);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), GetParam().field, GetParam().text);
  EXPECT_EQ(checked.status().violations().size(), 1u) << checked.status().ToString();
}

INSTANTIATE_TEST_SUITE_P(
    SettingsAndCopies, CreateClothsValidation,
    testing::Values(
        BadCreation{"UnknownPreset",
                    [](auto& r) {
                      Spec(r).mutable_settings()->set_preset(
                          static_cast<v1::StepSettings::Preset>(42));
                    },
                    "spec.settings.preset", "42 is not a known value"},
        BadCreation{"UnknownSpringIntegration",
                    [](auto& r) {
                      Spec(r).mutable_settings()->set_spring_integration(
                          static_cast<v1::StepSettings::SpringIntegration>(-1));
                    },
                    "spec.settings.spring_integration", "IN_FORCE, HALF_KICKS"},
        BadCreation{"NegativeLoadLimit",
                    [](auto& r) { Spec(r).mutable_settings()->set_load_limit(-1); },
                    "spec.settings.load_limit", "[0, 1e+06]"},
        BadCreation{"SleepMotionBelowZero",
                    [](auto& r) { Spec(r).mutable_settings()->set_sleep_motion_m(-1); },
                    "spec.settings.sleep_motion_m", "[0, 1] m"},
        BadCreation{"RefineAboveWholeStrain",
                    [](auto& r) { Spec(r).mutable_settings()->set_refine_above_strain(1); },
                    "spec.settings.refine_above_strain", "[0, 1)"},
        BadCreation{"NegativeFrameBudget",
                    [](auto& r) { Spec(r).mutable_settings()->set_frame_budget_ms(-1); },
                    "spec.settings.frame_budget_ms", "[0, 10000] ms"},
        BadCreation{"NoTimeStep", [](auto& r) { Spec(r).mutable_settings()->set_time_step_s(0); },
                    "spec.settings.time_step_s", "(0, 10]"},
        BadCreation{"NegativeTimeStep",
                    [](auto& r) { Spec(r).mutable_settings()->set_time_step_s(-1); },
                    "spec.settings.time_step_s", "-1"},
        BadCreation{"NotANumberTolerance",
                    [](auto& r) { Spec(r).mutable_settings()->set_tolerance(kNaN); },
                    "spec.settings.tolerance", "nan"},
        BadCreation{"NoCopies", [](auto& r) { r.set_count(0); }, "count", "0 is not in [1, "},
        BadCreation{"ManyCopies", [](auto& r) { r.set_count(4000000000u); }, "count", "4000000000"},
        BadCreation{"ShortOrigins",
                    [](auto& r) { r.mutable_environment_origins_m()->RemoveLast(); },
                    "environment_origins_m", "has 5 elements, needs 6"},
        BadCreation{"InfiniteOrigin", [](auto& r) { r.set_environment_origins_m(4, kInfinity); },
                    "environment_origins_m[4]", "inf"},
        BadCreation{"ShortTransforms", [](auto& r) { r.mutable_transforms()->RemoveLast(); },
                    "transforms", "has 13 elements, needs 14"},
        BadCreation{"ZeroQuaternionOfCopy", [](auto& r) { r.set_transforms(6, 0); },
                    "transforms[3]", "not a rotation"},
        BadCreation{"OneOverride", [](auto& r) { r.mutable_overrides()->RemoveLast(); },
                    "overrides", "has 1 elements, needs 2"},
        BadCreation{"OverrideGravity",
                    [](auto& r) { r.mutable_overrides(1)->set_gravity_m_per_s2(0, kNaN); },
                    "overrides[1].gravity_m_per_s2[0]", "nan"},
        BadCreation{"OverrideSettings",
                    [](auto& r) { r.mutable_overrides(0)->mutable_settings()->set_substeps(0); },
                    "overrides[0].settings.substeps", "[1, 10000]"},
        BadCreation{"OverrideFriction",
                    [](auto& r) { r.mutable_overrides(1)->set_friction_static(0.1); },
                    "overrides[1].friction_dynamic", "0.4"},
        BadCreation{"OverrideDamping",
                    [](auto& r) { r.mutable_overrides(0)->set_damping_per_s(-2); },
                    "overrides[0].damping_per_s", "-2"}),
    NameOf());

TEST(CreateClothsRules, EveryViolationIsNamedAtOnce) {
  v1::CreateClothsRequest request = GoodCreation();
  request.mutable_spec()->mutable_grid()->set_width_m(-1);
  request.mutable_spec()->mutable_pins(0)->set_particle(99);
  request.mutable_spec()->mutable_settings()->set_substeps(0);
  request.set_transforms(0, kNaN);
  const Status status = CheckCreateCloths(request, {}).status();
  std::vector<std::string> fields;
  for (const auto& violation : status.violations()) fields.push_back(violation.field);
  EXPECT_THAT(fields, testing::UnorderedElementsAre("spec.grid.width_m", "spec.pins[0].particle",
                                                    "spec.settings.substeps", "transforms[0]"));
}

TEST(CreateClothsRules, CopiesOfManyCollidersAreBounded) {
  v1::CreateClothsRequest request = GoodCreation();
  request.clear_environment_origins_m();
  request.clear_transforms();
  request.clear_overrides();
  request.set_count(3);
  RequestLimits limits;
  limits.max_colliders_per_request = 12;
  EXPECT_TRUE(CheckCreateCloths(request, limits).ok());
  request.set_count(4);
  ExpectViolation(CheckCreateCloths(request, limits).status(), "count", "at most 12 colliders");
}

// A field of 16 MB that no version knows, once for each of the copies: 64 GB to copy.
TEST(CreateClothsRules, WhatNobodyKnowsIsNotCopiedForEveryOverride) {
  v1::CreateClothsRequest request = GoodCreation();
  request.clear_environment_origins_m();
  request.clear_transforms();
  request.clear_overrides();
  v1::StepSettings* const settings = request.mutable_spec()->mutable_settings();
  settings->GetReflection()->MutableUnknownFields(settings)->AddLengthDelimited(
      20'000, std::string(16'000'000, 'x'));
  constexpr uint32_t kCopies = 4096;
  request.set_count(kCopies);
  for (uint32_t k = 0; k < kCopies; ++k) request.add_overrides()->mutable_settings();
  const std::clock_t start = std::clock();
  EXPECT_TRUE(CheckCreateCloths(request, {}).ok());
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 2);
}

TEST(CreateClothsRules, ReadsEverythingOfAGoodRequest) {
  const auto checked = CheckCreateCloths(GoodCreation(), {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& grid = std::get<GridTopology>(checked->description->topology);
  EXPECT_EQ(grid.columns, 4u);
  EXPECT_EQ(grid.height_m, 0.2);
  EXPECT_THAT(checked->description->pinned_particles, testing::ElementsAre(0, 3));
  EXPECT_FALSE(checked->pins[0].target_m);
  EXPECT_EQ(*checked->pins[1].target_m, Eigen::Vector3d(0.3, 0.1, 0));

  ASSERT_EQ(checked->copies.size(), 2u);
  const ClothCopy& first = checked->copies[0];
  const ClothCopy& second = checked->copies[1];
  EXPECT_EQ(second.environment_origin_m, Eigen::Vector3d(10, 0, 0));
  EXPECT_EQ(second.transform.position_m, Eigen::Vector3d(0, 5, 0));
  // (0, 1, 0, 1) normalised: a quarter turn about y takes z to x.
  EXPECT_NEAR(
      (second.transform.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 0,
      1e-15);
  EXPECT_EQ(first.parameters.gravity_m_per_s2, Eigen::Vector3d(0, -9, 0));
  EXPECT_EQ(second.parameters.gravity_m_per_s2, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(first.parameters.wind_m_per_s, Eigen::Vector3d(2, 0, 1));
  EXPECT_EQ(second.parameters.wind_m_per_s, Eigen::Vector3d(0, 0, 7));
  EXPECT_EQ(first.parameters.air_drag, 1.2);
  EXPECT_EQ(second.parameters.air_lift, 0.8);
  EXPECT_EQ(second.parameters.damping_per_s, 0.25);
  EXPECT_EQ(second.parameters.friction_dynamic, 0.4);
  // The override changes one field of the spec's settings, not the others.
  EXPECT_EQ(first.parameters.settings.max_iterations, 100u);
  EXPECT_EQ(second.parameters.settings.max_iterations, 3u);
  EXPECT_EQ(second.parameters.settings.substeps, 7u);
  EXPECT_EQ(second.parameters.settings.preset, Preset::kAccurate);
  EXPECT_EQ(first.parameters.colliders[1].shape, Shape(PlaneShape{Eigen::Vector3d::UnitY()}));
}

using BadStep = BadCase<v1::StepRequest>;
class StepValidation : public testing::TestWithParam<BadStep> {};

TEST_P(StepValidation, NamesFieldValueAndRange) {
  v1::StepRequest request = GoodStep();
  ASSERT_TRUE(CheckStep(request, kMaxSteps).ok());
  GetParam().spoil(request);
  const auto checked = CheckStep(request, kMaxSteps);
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), GetParam().field, GetParam().text);
}

INSTANTIATE_TEST_SUITE_P(
    All, StepValidation,
    testing::Values(
        BadStep{"NoExtent", [](auto& r) { r.clear_extent(); }, "steps", "until_step"},
        BadStep{"NoCloths", [](auto& r) { r.clear_cloth_ids(); }, "cloth_ids",
                "name at least 1 cloth, or set all_cloths"},
        BadStep{"NamedAndAllCloths", [](auto& r) { r.set_all_cloths(true); }, "all_cloths",
                "is set beside 1 cloth_ids"},
        BadStep{"NoSteps", [](auto& r) { r.set_steps(0); }, "steps", "0 is not in [1, 1000]"},
        BadStep{"ManySteps", [](auto& r) { r.set_steps(1001); }, "steps", "1001"},
        BadStep{"ParticleOfTheViewTwice",
                [](auto& r) {
                  Set(r.mutable_view()->mutable_particles(), {0, 7, 7});
                },
                "view.particles[2]", "7 is not above 7"},
        BadStep{"ParticlesOfTheViewDescend",
                [](auto& r) {
                  Set(r.mutable_view()->mutable_particles(), {5, 2, 3});
                },
                "view.particles[1]", "2 is not above 5"},
        BadStep{"ShortTargets",
                [](auto& r) { r.mutable_pin_controls()->mutable_targets_m()->RemoveLast(); },
                "pin_controls.targets_m", "has 2 elements, needs 3"},
        BadStep{"NoParticles", [](auto& r) { r.mutable_pin_controls()->clear_particles(); },
                "pin_controls.particles", "has 0 elements, needs 1"},
        BadStep{"LongOver", [](auto& r) { r.mutable_pin_controls()->add_over_s(1); },
                "pin_controls.over_s", "has 2 elements, needs 1"},
        BadStep{"NegativeOver", [](auto& r) { r.mutable_pin_controls()->set_over_s(0, -1); },
                "pin_controls.over_s[0]", "-1"},
        BadStep{"NoCollider", [](auto& r) { r.mutable_collider_controls()->clear_colliders(); },
                "collider_controls.colliders", "has 0 elements, needs 1"},
        BadStep{"NoPosition", [](auto& r) { r.mutable_collider_controls()->clear_positions_m(); },
                "collider_controls.positions_m", "has 0 elements, needs 3"},
        BadStep{"HalfARotation",
                [](auto& r) {
                  Set(r.mutable_collider_controls()->mutable_rotations_xyzw(), {0, 1});
                },
                "collider_controls.rotations_xyzw", "has 2 elements, needs 4"},
        BadStep{"NoRotation",
                [](auto& r) {
                  Set(r.mutable_collider_controls()->mutable_rotations_xyzw(), {0, 0, 0, 0});
                },
                "collider_controls.rotations_xyzw[0]", "not a rotation"},
        BadStep{"InfinitePosition",
                [](auto& r) {
                  r.mutable_collider_controls()->set_positions_m(
                      2, std::numeric_limits<double>::infinity());
                },
                "collider_controls.positions_m[2]", "inf"},
        BadStep{"NegativeColliderOver",
                [](auto& r) { r.mutable_collider_controls()->set_over_s(0, -1); },
                "collider_controls.over_s[0]", "-1"},
        BadStep{"NoConstraints",
                [](auto& r) { r.mutable_rest_length_controls()->clear_constraints(); },
                "rest_length_controls.constraints", "has 0 elements, needs 1"},
        BadStep{"NoLengths", [](auto& r) { r.mutable_rest_length_controls()->clear_lengths_m(); },
                "rest_length_controls.lengths_m", "has 0 elements, needs 1"},
        BadStep{"ZeroLength",
                [](auto& r) { r.mutable_rest_length_controls()->set_lengths_m(0, 0); },
                "rest_length_controls.lengths_m[0]", "0 is not in"},
        BadStep{"NegativeLengthOver",
                [](auto& r) { r.mutable_rest_length_controls()->set_over_s(0, -2); },
                "rest_length_controls.over_s[0]", "-2"},
        BadStep{"NoSlots", [](auto& r) { r.mutable_grip_controls()->clear_slots(); },
                "grip_controls.slots", "has 0 elements, needs 4"},
        BadStep{"FewActions",
                [](auto& r) { r.mutable_grip_controls()->mutable_actions()->RemoveLast(); },
                "grip_controls.actions", "has 3 elements, needs 4"},
        BadStep{"UnknownAction",
                [](auto& r) {
                  r.mutable_grip_controls()->set_actions(2, v1::GripControls::ACTION_UNSPECIFIED);
                },
                "grip_controls.actions[2]", "0 is none of HOLD (1)"},
        BadStep{"NoRadius", [](auto& r) { r.mutable_grip_controls()->clear_radii_m(); },
                "grip_controls.radii_m[1]", "0 is not in (0, "},
        BadStep{"FewGripPlaces",
                [](auto& r) { r.mutable_grip_controls()->mutable_targets_m()->RemoveLast(); },
                "grip_controls.targets_m", "has 11 elements, needs 12"},
        BadStep{"NotANumberGripPlace",
                [](auto& r) { r.mutable_grip_controls()->set_targets_m(4, kNaN); },
                "grip_controls.targets_m[4]", "nan"},
        BadStep{"NegativeGripOver", [](auto& r) { r.mutable_grip_controls()->set_over_s(2, -1); },
                "grip_controls.over_s[2]", "-1"},
        BadStep{"FewGrippedParticles",
                [](auto& r) { r.mutable_grip_controls()->mutable_particles()->RemoveLast(); },
                "grip_controls.particles", "has 3 elements, needs 4"},
        BadStep{"ShortTransforms",
                [](auto& r) { r.mutable_resets()->mutable_transforms()->RemoveLast(); },
                "resets.transforms", "has 6 elements, needs 7"},
        BadStep{"NoRotationOfAReset", [](auto& r) { r.mutable_resets()->set_transforms(5, 0); },
                "resets.transforms[3]", "not a rotation"},
        BadStep{"ManyOverrides", [](auto& r) { r.mutable_resets()->add_overrides(); },
                "resets.overrides", "has 2 elements, needs 1"},
        BadStep{"BouncyOverride",
                [](auto& r) { r.mutable_resets()->mutable_overrides(0)->set_restitution(1.5); },
                "resets.overrides[0].restitution", "1.5 is not in [0, 1]"},
        BadStep{"SettingsOfOneCloth",
                [](auto& r) {
                  r.mutable_resets()->mutable_overrides(0)->mutable_settings()->set_substeps(3);
                },
                "resets.overrides[0].settings", "are the same for all cloths here"},
        BadStep{"NotANumberGravity",
                [](auto& r) {
                  r.mutable_resets()->mutable_overrides(0)->set_gravity_m_per_s2(1, kNaN);
                },
                "resets.overrides[0].gravity_m_per_s2[1]", "nan"},
        BadStep{"ManySavedCloths", [](auto& r) { r.mutable_loads()->add_saved_cloth_ids(4); },
                "loads.saved_cloth_ids", "has 2 entries; it is empty or has one per cloth (1)"},
        BadStep{"NoSavedName", [](auto& r) { r.mutable_loads()->clear_name(); }, "loads.name",
                "has 0 bytes; legal: 1 to 128"},
        BadStep{"NoScales", [](auto& r) { r.mutable_rest_length_scales()->clear_scales(); },
                "rest_length_scales.scales", "has 0 elements, needs 1"},
        BadStep{"NotANumberScale",
                [](auto& r) { r.mutable_rest_length_scales()->set_scales(0, kNaN); },
                "rest_length_scales.scales[0]", "nan"},
        BadStep{"NotANumberTarget",
                [](auto& r) { r.mutable_pin_controls()->set_targets_m(1, kNaN); },
                "pin_controls.targets_m[1]", "nan"}),
    NameOf());

TEST(StepRules, ColliderControlsAreReadWithTheirRotations) {
  v1::StepRequest request = GoodStep();
  auto step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  ASSERT_EQ(step->controls.colliders.size(), 1u);
  EXPECT_EQ(step->controls.colliders[0].control.collider, 2u);
  EXPECT_EQ(step->controls.colliders[0].control.target.position_m, Eigen::Vector3d(0, 1, 2));
  EXPECT_EQ(step->controls.colliders[0].control.target.rotation.coeffs(),
            Eigen::Vector4d(0, 0, 1, 0));
  EXPECT_EQ(step->controls.colliders[0].control.over_s, 0.75);
  request.mutable_collider_controls()->clear_rotations_xyzw();
  request.mutable_collider_controls()->clear_over_s();
  step = CheckStep(request, 10);
  EXPECT_EQ(step->controls.colliders[0].control.target.rotation.coeffs(),
            Eigen::Vector4d(0, 0, 0, 1));
  EXPECT_EQ(step->controls.colliders[0].control.over_s, 0);
}

TEST(StepRules, ResetsAreRead) {
  const auto step = CheckStep(GoodStep(), 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  EXPECT_EQ(step->resets.cloths, std::vector<ClothId>{ClothId::FromPacked(1)});
  const ClothStarts& starts = step->resets.starts;
  ASSERT_EQ(starts.transforms.size(), 1u);
  EXPECT_EQ(starts.transforms[0].position_m, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(starts.transforms[0].rotation.coeffs(), Eigen::Vector4d(0, 0, 1, 0));
  ASSERT_EQ(starts.overrides.size(), 1u);
  EXPECT_EQ(starts.overrides[0].gravity_m_per_s2, Eigen::Vector3d(0, -5, 0));
  EXPECT_FALSE(starts.overrides[0].wind_m_per_s.has_value());
  EXPECT_TRUE(starts.overrides[0].numbers.IsSet(&ClothParameters::restitution));
}

TEST(StepRules, LoadsAreRead) {
  v1::StepRequest request = GoodStep();
  auto step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  EXPECT_EQ(step->loads.name, "start");
  EXPECT_EQ(step->loads.cloths, std::vector<ClothId>{ClothId::FromPacked(2)});
  EXPECT_EQ(step->loads.saved, std::vector<ClothId>{ClothId::FromPacked(3)});
  request.mutable_loads()->Clear();
  step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << "an empty selection needs no name";
  EXPECT_TRUE(step->loads.cloths.empty());
}

TEST(ResetValidation, RowsBelongToNamedCloths) {
  v1::ResetClothsRequest request;
  ExpectViolation(CheckReset(request).status(), "cloth_ids", "all_cloths");
  request.set_all_cloths(true);
  EXPECT_TRUE(CheckReset(request).ok());
  request.add_overrides();
  ExpectViolation(CheckReset(request).status(), "all_cloths", "name the cloths");
  request.clear_all_cloths();
  request.add_cloth_ids(4);
  EXPECT_TRUE(CheckReset(request).ok());
  request.add_transforms(0);
  ExpectViolation(CheckReset(request).status(), "transforms", "has 1 elements, needs 7");
}

TEST(StepRules, AnEmptyViewAsksForPositionsAndNoViewForNothing) {
  v1::StepRequest request = GoodStep();
  request.clear_view();
  EXPECT_FALSE(CheckStep(request, kMaxSteps)->view.any());
  request.mutable_view();
  EXPECT_EQ(CheckStep(request, kMaxSteps)->view.fields, (StateFields{true, false}));
  request.mutable_view()->set_velocities(true);
  EXPECT_EQ(CheckStep(request, kMaxSteps)->view.fields, (StateFields{false, true}));
  Set(request.mutable_view()->mutable_particles(), {3, 9});
  EXPECT_EQ(CheckStep(request, kMaxSteps)->view.fields, (StateFields{false, true, {3, 9}}));
}

v1::UpdateClothsRequest Update(std::initializer_list<const char*> paths) {
  v1::UpdateClothsRequest request;
  request.add_cloth_ids(1);
  for (const char* path : paths) request.mutable_update_mask()->add_paths(path);
  return request;
}

TEST(UpdateClothsValidation, OnlyThePathsOfTheMaskAreRead) {
  v1::UpdateClothsRequest request = Update({"environment.gravity_m_per_s2", "pins"});
  Set(request.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {1, 2, 3});
  request.mutable_spec()->add_pins()->set_particle(7);
  request.mutable_spec()->mutable_material()->set_damping_per_s(kNaN);  // not in the mask
  const auto change = CheckUpdateCloths(request, {});
  ASSERT_TRUE(change.ok()) << change.status().ToString();
  EXPECT_EQ(*change->gravity_m_per_s2, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(change->pins->front().particle, 7u);
  EXPECT_FALSE(change->colliders || change->settings || change->wind_m_per_s ||
               change->numbers.is_any_set() || change->model.is_any_set());
}

TEST(UpdateClothsValidation, EveryDocumentedPathIsRead) {
  const auto change = CheckUpdateCloths(Update({"environment.gravity_m_per_s2",
                                                "environment.colliders",
                                                "pins",
                                                "settings",
                                                "material.damping_per_s",
                                                "material.friction_static",
                                                "material.friction_dynamic",
                                                "material.restitution",
                                                "material.thickness_m",
                                                "environment.wind_m_per_s",
                                                "material.air_drag",
                                                "material.air_lift",
                                                "material.stretch_compliance_m_per_n",
                                                "material.bending_stiffness_n_per_m",
                                                "material.shear_stiffness_n_per_m",
                                                "material.bending_rigidity_n_m",
                                                "material.stretch_stiffness_n_per_m",
                                                "material.shear_modulus_n_per_m",
                                                "particles.distance_constraints",
                                                "particles.springs",
                                                "particles.point_joints"}),
                                        {});
  ASSERT_TRUE(change.ok()) << change.status().ToString();
  EXPECT_TRUE(change->gravity_m_per_s2 && change->colliders && change->pins && change->settings &&
              change->wind_m_per_s);
  for (const SurfaceField& field : kSurfaceFields) {
    EXPECT_TRUE(change->numbers.IsSet(field.member)) << field.name;
  }
  for (const StructuralField& field : kStructuralFields) {
    EXPECT_EQ(change->model.material.IsSet(field.member), field.may_change) << field.name;
  }
}

TEST(UpdateClothsValidation, ConnectionsAreReadWithTheLengthsThatAreSet) {
  v1::UpdateClothsRequest request =
      Update({"particles.distance_constraints", "particles.springs", "particles.point_joints"});
  *request.mutable_spec()->mutable_particles() = test::ShortChain();
  v1::Particles& particles = *request.mutable_spec()->mutable_particles();
  particles.mutable_distance_constraints(1)->set_rest_length_m(0.5);
  particles.mutable_distance_constraints(1)->set_kind(v1::DistanceConstraint::AT_LEAST);
  particles.add_point_joints()->set_j(2);
  const auto change = CheckUpdateCloths(request, {});
  ASSERT_TRUE(change.ok()) << change.status().ToString();
  const auto& constraints = *change->model.distance_constraints;
  EXPECT_EQ(constraints[0].rest_length_m, kRestShapeLength);
  EXPECT_EQ(constraints[1].rest_length_m, 0.5);
  EXPECT_EQ(constraints[1].kind, ConstraintKind::kAtLeast);
  EXPECT_EQ(change->model.springs->front().stiffness_n_per_m, 5);
  EXPECT_EQ(change->model.point_joints->front().j, 2u);
  EXPECT_TRUE(change->needs_model());

  particles.mutable_distance_constraints(1)->set_rest_length_m(kNaN);
  particles.mutable_springs(0)->set_rest_length_m(-1);
  particles.mutable_distance_constraints(0)->set_kind(static_cast<v1::DistanceConstraint::Kind>(9));
  const Status status = CheckUpdateCloths(request, {}).status();
  ExpectViolation(status, "spec.particles.distance_constraints[0].kind", "9 is not a known value");
  ExpectViolation(status, "spec.particles.distance_constraints[1].rest_length_m", "nan");
  ExpectViolation(status, "spec.particles.springs[0].rest_length_m", "-1");
}

TEST(UpdateClothsValidation, RefusesUnknownAndRepeatedPathsEmptyMasksAndNoIds) {
  ExpectViolation(CheckUpdateCloths(Update({"pins", "material.colour"}), {}).status(),
                  "update_mask.paths[1]", "'material.colour' is not one of");
  ExpectViolation(CheckUpdateCloths(Update({}), {}).status(), "update_mask.paths", "is empty");
  ExpectViolation(CheckUpdateCloths(Update({"pins", "settings", "pins"}), {}).status(),
                  "update_mask.paths[2]", "'pins' occurs twice");
  v1::UpdateClothsRequest request = Update({"pins"});
  request.clear_cloth_ids();
  ExpectViolation(CheckUpdateCloths(request, {}).status(), "cloth_ids", "at least 1");
}

TEST(UpdateClothsValidation, ChecksTheValues) {
  v1::UpdateClothsRequest request = Update({"material.thickness_m", "settings"});
  request.mutable_spec()->mutable_material()->set_thickness_m(-1);
  request.mutable_spec()->mutable_settings()->set_time_step_s(11);
  const Status status = CheckUpdateCloths(request, {}).status();
  ExpectViolation(status, "spec.material.thickness_m", "-1");
  ExpectViolation(status, "spec.settings.time_step_s", "11");
}

TEST(UpdateClothsValidation, CollidersOfManyClothsAreBounded) {
  v1::UpdateClothsRequest request = Update({"environment.colliders"});
  *request.mutable_spec() = GoodCreation().spec();  // 4 colliders
  RequestLimits limits;
  limits.max_colliders_per_request = 8;
  request.add_cloth_ids(2);
  EXPECT_TRUE(CheckUpdateCloths(request, limits).ok());
  request.add_cloth_ids(3);
  ExpectViolation(CheckUpdateCloths(request, limits).status(), "cloth_ids",
                  "3 cloths of 4 colliders, at most 8 colliders");
}

}  // namespace
}  // namespace drape::api
