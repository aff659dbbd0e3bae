// The cells of the atlas that REALTIME has to stand, at 1/60 s; `./run bench stability` has the
// rest.
#include <gtest/gtest.h>

#include <string>

#include "tests/stability/atlas/atlas_scenes.h"
#include "tests/stability/atlas/trial.h"
#include "tests/support/backends/backends.h"

namespace drape::test {
namespace {

void ExpectGood(const TrialResult& result) {
  EXPECT_EQ(result.violation, "");
  EXPECT_FALSE(result.is_cut) << "took " << result.wall_s << " s";
  const bool is_good = result.verdict == Verdict::kSurvives || result.verdict == Verdict::kRecovers;
  EXPECT_TRUE(is_good) << VerdictName(result.verdict) << ", strain " << result.max_strain
                       << ", at the end " << result.end_strain << ", energy " << result.max_gain
                       << ", at the end " << result.end_gain;
}

void TryThinForm(const std::string& backend_name) {
  Backend& backend = SharedBackend(backend_name);
  const AtlasMethod method = AtlasMethods(AtlasForm::kThin).at(0);
  Neighbour neighbour(backend, method.settings);
  for (const AtlasTable& table : AtlasTables(AtlasForm::kThin)) {
    for (const AxisValue& row : table.rows.values) {
      for (const AxisValue& column : table.columns.values) {
        const std::string cell = table.name + ": " + row.label + ", " + column.label;
        SCOPED_TRACE(cell);
        const AtlasCase atlas_case = table.make(row.value, column.value);
        StepSettings settings = method.settings;
        settings.time_step_s = atlas_case.time_step_s;
        const TrialResult result = RunTrial(backend, neighbour, atlas_case, settings, {});
        if (table.is_within_bar(row.value, column.value)) {
          ExpectGood(result);
        } else {
          EXPECT_EQ(result.violation, "");
        }
      }
    }
  }
}

// Like the required start across a sphere's centre: they survive, and do not have to recover first.
void TryCaughtStarts(const std::string& backend_name) {
  Backend& backend = SharedBackend(backend_name);
  const StepSettings realtime = PresetSettings(Preset::kRealtime);
  Neighbour neighbour(backend, realtime);
  for (const auto& [name, atlas_case] : CaughtCases()) {
    SCOPED_TRACE(name);
    const TrialResult result = RunTrial(backend, neighbour, atlas_case, realtime, {});
    ExpectGood(result);
    EXPECT_EQ(result.verdict, Verdict::kSurvives);
  }
}

TEST(AtlasTest, CaughtStartsSurviveOnCpu) {
  TryCaughtStarts("cpu");
}
TEST(AtlasLong, CaughtStartsSurviveOnReference) {
  TryCaughtStarts("reference");
}
TEST(AtlasLong, CaughtStartsSurviveOnGl) {
  TryCaughtStarts("gl");
}

TEST(AtlasTest, RealtimeMeetsTheBarOnCpu) {
  TryThinForm("cpu");
}
TEST(AtlasLong, RealtimeMeetsTheBarOnReference) {
  TryThinForm("reference");
}
TEST(AtlasLong, RealtimeMeetsTheBarOnGl) {
  TryThinForm("gl");
}

// The judge itself: a case that does nothing survives, one that explodes faults, one whose pins
// stretch it beyond the allowed warns where the method watches convergence and breaks where not.
TEST(TrialTest, JudgesByStrainEnergyAndReports) {
  Backend& backend = SharedBackend("cpu");
  const StepSettings realtime = PresetSettings(Preset::kRealtime);
  Neighbour neighbour(backend, realtime);
  const TrialLimits limits{.duration_s = 0.2, .max_steps = 12, .least_s = 0, .wall_s = 60};

  AtlasCase still{.scene = Grid(4, 4, 1, 1, {0, 3})};
  still.scene.parameters.gravity_m_per_s2.setZero();
  EXPECT_EQ(RunTrial(backend, neighbour, still, realtime, limits).verdict, Verdict::kSurvives);

  const AtlasCase explosive{.scene = ExplosiveSheet(5)};
  const TrialResult faulted = RunTrial(backend, neighbour, explosive, realtime, limits);
  EXPECT_EQ(faulted.verdict, Verdict::kFaults);
  EXPECT_EQ(faulted.violation, "");
  EXPECT_NE(faulted.warnings.find("springs_beyond_limit"), std::string::npos);

  AtlasCase stretched{.scene = Grid(2, 1, 1, 1, {0})};
  stretched.scene.state.positions_m[1].x() = 1.5;
  const StepSettings paper = PresetSettings(Preset::kPaper);
  EXPECT_EQ(RunTrial(backend, neighbour, stretched, paper, limits).verdict, Verdict::kRecovers);
  AtlasCase torn{.scene = Grid(3, 1, 1, 1, {0, 2})};
  torn.scene.state.positions_m[2].x() = 2;
  const TrialResult warned = RunTrial(backend, neighbour, torn, paper, limits);
  EXPECT_EQ(warned.verdict, Verdict::kWarns);
  EXPECT_GE(warned.max_strain, 1) << "2 m instead of 1 m";
  EXPECT_EQ(RunTrial(backend, neighbour, torn, realtime, limits).verdict, Verdict::kBreaks);
}

}  // namespace
}  // namespace drape::test
