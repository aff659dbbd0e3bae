#include "server/solver/step_plan.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/solver/solver_constants.h"
#include "tests/support/garments.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

using enum StepStage;

StepPlan PlanFloat(const SceneModel& model, const ClothParameters& parameters) {
  return PlanStep(model, parameters, LengthSource::kModel, ScalarType::kFloat32);
}

// Two steps extrapolate the errors that sweeps leave, which are large if the masses around a
// particle differ.
TEST(StepPlanTest, UnequalMassesKeepToOneStep) {
  ParticleTopology star;
  star.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  for (uint32_t k = 1; k < 5; ++k) star.distance_constraints.push_back({0, k, 1, 0});
  for (const double mass_kg : {9.0, 11.0}) {
    star.masses_kg = {1, mass_kg, mass_kg, mass_kg, mass_kg};
    const auto model =
        SceneModel::Build({.topology = star, .material = {}, .pinned_particles = {}}).value();
    EXPECT_EQ(PlanFloat(*model, {}).solver.has_two_steps, mass_kg < kMaxHeldMassRatio);
  }
}

// Start directions keep energy where a sheet hangs by a whole edge and sweeps end at a tolerance.
// By two corners, on colliders or with unequal masses they would gain it.
TEST(StepPlanTest, WhatHangsByAnEdgeKeepsItsEnergy) {
  const auto has_two_steps = [](const test::Scene& scene, Preset preset, bool has_collider) {
    ClothParameters parameters = scene.parameters;
    parameters.settings = PresetSettings(preset);
    if (has_collider) parameters.colliders = test::FallingOnSphere(4).parameters.colliders;
    return PlanFloat(*scene.model, parameters).solver.has_two_steps;
  };
  const test::Scene edge = test::Grid(5, 7, 1, 1, {0, 1, 2, 3, 4});
  EXPECT_FALSE(has_two_steps(edge, Preset::kAccurate, false));
  EXPECT_TRUE(has_two_steps(edge, Preset::kAccurate, true));
  EXPECT_TRUE(has_two_steps(edge, Preset::kRealtime, false));
  EXPECT_TRUE(has_two_steps(test::Grid(5, 7, 1, 1, {0, 4}), Preset::kAccurate, false));
  EXPECT_TRUE(has_two_steps(test::Grid(5, 7, 1, 1), Preset::kAccurate, false));
  ParticleTopology chain;
  for (uint32_t k = 0; k < 4; ++k) chain.positions_m.push_back({0.1 * k, 0, 0});
  for (uint32_t k = 1; k < 4; ++k) chain.distance_constraints.push_back({k - 1, k, 0.1, 0});
  for (const double ratio : {9.0, 11.0}) {
    chain.masses_kg = {1, 1, ratio, 1};
    EXPECT_EQ(has_two_steps(test::Particles(chain, {0}), Preset::kAccurate, false), ratio > 10);
  }
}

// Where strips cross in many phases: compliant links look ahead unless sweeps end at a tolerance,
// and positions carry what rounding takes from them.
TEST(StepPlanTest, MeshesLookAheadAndKeepTheirRemainders) {
  const auto solver = [](const test::Scene& scene, Preset preset) {
    ClothParameters parameters = scene.parameters;
    parameters.settings = PresetSettings(preset);
    return PlanFloat(*scene.model, parameters).solver;
  };
  const test::Scene mesh = test::IrregularSheet({.cell_m = 0.2});
  const test::Scene rigid = test::IrregularSheet({.cell_m = 0.2, .stretch_stiffness_n_per_m = 0});
  EXPECT_EQ(solver(mesh, Preset::kRealtime).link_lead, kLinkLead);
  EXPECT_TRUE(solver(mesh, Preset::kRealtime).always_has_remainders());
  EXPECT_EQ(solver(mesh, Preset::kAccurate).link_lead, 0);
  EXPECT_EQ(solver(mesh, Preset::kPaper).link_lead, 0);
  EXPECT_EQ(solver(mesh, Preset::kPaper).remainder_speed_m_per_s, 0);
  EXPECT_EQ(solver(rigid, Preset::kRealtime).link_lead, 0);
  EXPECT_TRUE(solver(rigid, Preset::kRealtime).always_has_remainders());
  test::Scene on_plane = mesh;  // beside friction, too
  on_plane.parameters.colliders = {PlaneThrough({0, -1, 0}, {0, 1, 0})};
  on_plane.parameters.friction_static = 0.5;
  EXPECT_TRUE(solver(on_plane, Preset::kRealtime).has_quiet_links);
  EXPECT_TRUE(solver(on_plane, Preset::kRealtime).always_has_remainders());
  const test::Scene grid = test::CompliantSheet(5, 1e-4);
  EXPECT_EQ(solver(grid, Preset::kRealtime).link_lead, 0);
  EXPECT_EQ(solver(grid, Preset::kRealtime).remainder_speed_m_per_s, kCalmSpeed_m_per_s);
}

// Sheets of 30 mm on two corners would flutter, those of 1 m in as many cells do not.
TEST(StepPlanTest, SpansOfHeavyClothsGiveWay) {
  const auto span_give = [](double width_m, std::vector<uint32_t> pins, Preset preset) {
    test::Scene scene = test::Grid(14, 11, width_m, 0.8 * width_m, std::move(pins));
    scene.parameters.settings = PresetSettings(preset);
    return PlanFloat(*scene.model, scene.parameters).solver.span_give;
  };
  EXPECT_GT(span_give(0.03, {0, 13}, Preset::kRealtime), 0);
  EXPECT_EQ(span_give(1, {0, 13}, Preset::kRealtime), 0);
  EXPECT_EQ(span_give(0.03, {0, 27}, Preset::kRealtime), 0) << "nothing is held taut";
  EXPECT_EQ(span_give(0.03, {0, 13}, Preset::kAccurate), 0);
  EXPECT_EQ(span_give(0.03, {0, 13}, Preset::kPaper), 0) << "colours";
}

// Lengths that contradict each other would be moved to in every step.
TEST(StepPlanTest, OnlyLengthsThatCanBeMetAreRefined) {
  ClothParameters parameters;
  parameters.settings = PresetSettings(Preset::kRealtime);
  EXPECT_GT(PlanFloat(*test::Grid(4, 4, 1, 1, {0}).model, parameters).solver.refine_rounds, 0u);
  for (const double length_m : {1.9, 3.0}) {
    const test::Scene triangle = test::Particles({{{0, 0, 0}, {1, 0, 0}, {2, 0.1, 0}},
                                                  {0.1, 0.1, 0.1},
                                                  {{0, 1, 1, 0}, {1, 2, 1, 0}, {0, 2, length_m, 0}},
                                                  {}},
                                                 {0});
    ASSERT_EQ(triangle.model->strips().phase_count(), 2u);
    EXPECT_EQ(PlanFloat(*triangle.model, parameters).solver.refine_rounds > 0, length_m < 2);
  }
}

// The same description with each requirement of a stage in turn, and the stages that it adds to
// those of every step.
TEST(StepPlanTest, StagesAreThoseWithSomethingToDo) {
  const StageSet always = {kPredict, kIntegrate, kCommit, kMeasure};
  const auto with = [&](std::initializer_list<StepStage> more) {
    StageSet stages = always;
    for (const StepStage stage : more) stages.Add(stage);
    return stages;
  };
  ClothParameters paper;
  paper.settings = PresetSettings(Preset::kPaper);
  const test::Scene sheet = test::Grid(4, 4, 1, 1, {0});
  EXPECT_EQ(PlanFloat(*sheet.model, paper).stages, with({kSolveDistance}));

  ClothParameters realtime;
  realtime.settings = PresetSettings(Preset::kRealtime);
  EXPECT_EQ(PlanFloat(*sheet.model, realtime).stages,
            with({kDampTwist, kTether, kSolveStrips, kRefine}));
  EXPECT_EQ(PlanFloat(*test::Grid(4, 4, 1, 1).model, realtime).stages,
            with({kDampTwist, kSolveStrips, kRefine}))
      << "tethers need pins";
  EXPECT_EQ(PlanStep(*sheet.model, realtime, LengthSource::kOwn, ScalarType::kFloat32).stages,
            with({kDampTwist, kSolveDistance}))
      << "driven lengths have neither strips nor tethers";

  ClothParameters damped = paper;
  damped.damping_per_s = 1;
  EXPECT_EQ(PlanFloat(*sheet.model, damped).stages, with({kSolveDistance, kCorrectVelocity}));
  ClothParameters on_plane = paper;
  on_plane.colliders = {PlaneThrough({0, -1, 0}, {0, 1, 0})};
  EXPECT_EQ(PlanFloat(*sheet.model, on_plane).stages,
            with({kSolveDistance, kSolveContacts, kCorrectVelocity}));
  ClothParameters in_wind = paper;
  in_wind.air_drag = 1;
  EXPECT_EQ(PlanFloat(*sheet.model, in_wind).stages, with({kSolveDistance, kApplyWind}));
  EXPECT_EQ(PlanFloat(*test::Chain(3, 0.1, 0.1).model, in_wind).stages, with({kSolveDistance}))
      << "a chain has no triangles";
  ClothParameters swept = paper;
  swept.settings.velocity_iterations = 2;
  EXPECT_EQ(PlanFloat(*sheet.model, swept).stages, with({kSolveDistance, kSolveVelocity}));
}

// In the force of the substep springs are no stage of their own.
TEST(StepPlanTest, SpringsActByKicksOrInTheForce) {
  test::Scene net = test::Net(4, 0.1, 0);
  ASSERT_GT(net.model->spring_count(), 0u);
  net.parameters.settings.spring_integration = SpringIntegration::kHalfKicks;
  EXPECT_TRUE(test::PlanOf(net).Has(kApplySprings));
  EXPECT_FALSE(test::PlanOf(net).solver.has_spring_forces);
  net.parameters.settings.spring_integration = SpringIntegration::kInForce;
  EXPECT_FALSE(test::PlanOf(net).Has(kApplySprings));
  EXPECT_TRUE(test::PlanOf(net).solver.has_spring_forces);
}

TEST(StepPlanTest, NamesOfStages) {
  EXPECT_EQ(StageName(StepStage::kApplySprings), "apply_springs");
  EXPECT_EQ(StageName(StepStage::kSolveContacts), "solve_contacts");
  EXPECT_EQ(StageName(StepStage::kMeasure), "measure");
}

TEST(StepPlanTest, TheToleranceIsRaisedOnlyBelowWhatPositionsResolve) {
  const test::Scene scene = test::Grid(11, 11, 1, 1);  // edges of 0.1 m, coordinates up to 1 m
  constexpr double kFloatUlp = std::numeric_limits<float>::epsilon();
  constexpr double kDoubleUlp = std::numeric_limits<double>::epsilon();
  const auto expect = [&](double requested, ScalarType scalar, double used) {
    ClothParameters parameters = test::PlainParameters();
    parameters.settings.tolerance = requested;
    const StepPlan plan = PlanStep(*scene.model, parameters, LengthSource::kModel, scalar);
    EXPECT_DOUBLE_EQ(plan.tolerance, used) << requested;
    EXPECT_EQ(plan.known_warnings.tolerance_raised, used > requested) << requested;
  };
  expect(0, ScalarType::kFloat32, 0);  // a fixed number of sweeps
  expect(1e-3, ScalarType::kFloat32, 1e-3);
  expect(1e-9, ScalarType::kFloat32, 4 * kFloatUlp * 1 / 0.1);
  expect(1e-9, ScalarType::kFloat64, 1e-9);
  expect(1e-30, ScalarType::kFloat64, 4 * kDoubleUlp * 1 / 0.1);
}

}  // namespace
}  // namespace drape
