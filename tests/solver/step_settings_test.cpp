#include "server/solver/step_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "server/solver/cloth_parameters.h"
#include "server/solver/step_report.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

using ::testing::HasSubstr;

TEST(StepSettings, PresetsAreWhatTheirNamesPromise) {
  const StepSettings paper = PresetSettings(Preset::kPaper);
  EXPECT_EQ(paper.substeps, 1u);
  EXPECT_EQ(paper.max_iterations, 100u);
  EXPECT_GT(paper.tolerance, 0);
  EXPECT_EQ(paper.spring_integration, SpringIntegration::kInForce);
  EXPECT_FALSE(paper.use_tethers);

  const StepSettings realtime = PresetSettings(Preset::kRealtime);
  EXPECT_EQ(realtime.substeps * realtime.max_iterations, 52u);
  EXPECT_EQ(realtime.tolerance, 0);
  EXPECT_EQ(realtime.spring_integration, SpringIntegration::kHalfKicks);
  EXPECT_TRUE(realtime.use_tethers);

  const StepSettings accurate = PresetSettings(Preset::kAccurate);
  EXPECT_LT(accurate.tolerance, paper.tolerance);
  EXPECT_EQ(accurate.spring_integration, SpringIntegration::kHalfKicks);
  EXPECT_FALSE(accurate.use_tethers);
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime, Preset::kAccurate}) {
    EXPECT_EQ(PresetSettings(preset).preset, preset);
    EXPECT_DOUBLE_EQ(PresetSettings(preset).time_step_s, 1.0 / 60);
  }
  EXPECT_EQ(PresetName(Preset::kPaper), "PAPER");
  EXPECT_EQ(PresetName(Preset::kRealtime), "REALTIME");
  EXPECT_EQ(PresetName(Preset::kAccurate), "ACCURATE");
}

TEST(StepSettings, NothingSetIsRealtime) {
  const auto settings = ResolveSettings({}, "settings");
  ASSERT_TRUE(settings.ok());
  EXPECT_EQ(*settings, PresetSettings(Preset::kRealtime));
  EXPECT_EQ(*settings, StepSettings());
  EXPECT_DOUBLE_EQ(settings->substep_s(), 1.0 / 3120);
}

TEST(StepSettings, WhatIsSetOverridesThePreset) {
  StepSettingsOverrides overrides;
  overrides.Set(&StepSettings::preset, Preset::kPaper)
      .Set(&StepSettings::time_step_s, 0.01)
      .Set(&StepSettings::substeps, 4)
      .Set(&StepSettings::max_iterations, 7)
      .Set(&StepSettings::tolerance, 0)
      .Set(&StepSettings::spring_integration, SpringIntegration::kHalfKicks)
      .Set(&StepSettings::use_tethers, true);
  const auto settings = ResolveSettings(overrides, "settings");
  ASSERT_TRUE(settings.ok());
  EXPECT_EQ(settings->preset, Preset::kPaper);
  EXPECT_EQ(settings->time_step_s, 0.01);
  EXPECT_TRUE(settings->use_tethers);
  EXPECT_EQ(settings->substeps, 4u);
  EXPECT_EQ(settings->max_iterations, 7u);
  EXPECT_EQ(settings->tolerance, 0);
  EXPECT_EQ(settings->spring_integration, SpringIntegration::kHalfKicks);
}

TEST(StepSettings, LimitsThemselvesAreLegal) {
  StepSettingsOverrides overrides;
  overrides.Set(&StepSettings::time_step_s, 10)
      .Set(&StepSettings::substeps, kMaxSubsteps)
      .Set(&StepSettings::max_iterations, kMaxIterations)
      .Set(&StepSettings::tolerance, std::nextafter(1.0, 0.0));
  EXPECT_TRUE(ResolveSettings(overrides, "settings").ok());
}

TEST(StepSettings, SubstepsBelowAMicrosecondAreRefused) {
  StepSettingsOverrides overrides;
  overrides.Set(&StepSettings::time_step_s, 1e-30);
  const auto settings = ResolveSettings(overrides, "settings");
  ASSERT_FALSE(settings.ok());
  EXPECT_THAT(settings.status().message(), HasSubstr("settings.time_step_s"));
  EXPECT_THAT(settings.status().message(),
              HasSubstr("1e-30 s in 52 substeps makes a substep below 1e-06 s"));

  overrides.Set(&StepSettings::time_step_s, 60 * kMinSubstep_s);
  EXPECT_TRUE(ResolveSettings(overrides, "settings").ok());
}

TEST(StepSettings, EveryBadValueIsNamedWithItsRange) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  struct Bad {
    std::string field;
    std::function<void(StepSettingsOverrides&)> spoil;
    std::string range;
  };
  std::vector<Bad> table;
  for (const double value : {0.0, -0.1, 10.1, kNan, kInf}) {
    table.push_back(
        {"time_step_s", [=](auto& o) { o.Set(&StepSettings::time_step_s, value); }, "(0, 10] s"});
  }
  for (const uint32_t value : {0u, 10001u, 4000000000u}) {
    table.push_back(
        {"substeps", [=](auto& o) { o.Set(&StepSettings::substeps, value); }, "[1, 10000]"});
    table.push_back({"max_iterations",
                     [=](auto& o) { o.Set(&StepSettings::max_iterations, value); }, "[1, 10000]"});
  }
  for (const double value : {-1e-3, 1.0, kNan, kInf}) {
    table.push_back(
        {"tolerance", [=](auto& o) { o.Set(&StepSettings::tolerance, value); }, "[0, 1)"});
  }
  for (const Bad& bad : table) {
    StepSettingsOverrides overrides;
    bad.spoil(overrides);
    const Status status =
        ResolveSettings(overrides, FieldPath("overrides").At(3).Child("settings")).status();
    ASSERT_FALSE(status.ok()) << bad.field;
    ASSERT_EQ(status.violations().size(), 1u);
    EXPECT_EQ(status.violations()[0].field, "overrides[3].settings." + bad.field);
    EXPECT_THAT(status.violations()[0].description, HasSubstr(bad.range));
  }
}

TEST(StepSettings, SeveralBadValuesAreToldAtOnce) {
  StepSettingsOverrides overrides;
  overrides.Set(&StepSettings::time_step_s, 0);
  overrides.Set(&StepSettings::substeps, 0);
  overrides.Set(&StepSettings::tolerance, 2);
  const Status status = ResolveSettings(overrides, "settings").status();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.violations().size(), 3u);
}

TEST(SolvesPerStep, CountsEverySolveOfTheWorstStep) {
  const test::Scene scene = test::Grid(4, 3, 1, 1);  // 9 + 8 edges
  StepSettings settings = test::PlainSettings();
  settings.substeps = 5;
  settings.max_iterations = 7;
  const double springs = 2.0 * scene.model->spring_count();
  const double tethers = 5 * 4 * 12;  // whatever the pins: they may be changed later
  const double air = 5 * 2 * 12;      // 12 triangles, whatever drag and lift are now
  EXPECT_EQ(SolvesPerStep(*scene.model, settings, 0), 35 * (17 + springs + 12) + tethers + air);
  settings.use_tethers = false;
  EXPECT_EQ(SolvesPerStep(*scene.model, settings, 0), 35 * (17 + springs + 12) + air);
  EXPECT_EQ(SolvesPerStep(*scene.model, settings, 3), 35 * (17 + springs + 48) + air);
  // 2 rods in each of 3 rows, one in each of 4 columns, 6 twists.
  const test::Scene fabric = test::Grid(4, 3, 1, 1, {}, {.bending_rigidity_n_m = 1e-4});
  EXPECT_EQ(SolvesPerStep(*fabric.model, settings, 0),
            SolvesPerStep(*scene.model, settings, 0) + 5 * 2 * (6 + 4 + 6));
  settings.substeps = kMaxSubsteps;
  settings.max_iterations = kMaxIterations;
  EXPECT_GT(SolvesPerStep(*scene.model, settings, 50), kMaxSolvesPerStep);
}

TEST(FaultReasonText, SaysWhatHappenedOrNothing) {
  EXPECT_EQ(FaultReasonText(FaultReason::kNone), "");
  EXPECT_THAT(std::string(FaultReasonText(FaultReason::kNotFinite)), HasSubstr("not a number"));
  EXPECT_THAT(std::string(FaultReasonText(FaultReason::kRunaway)), HasSubstr("1e5 m/s"));
}

}  // namespace
}  // namespace drape
