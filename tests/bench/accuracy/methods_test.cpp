#include "tests/bench/accuracy/methods.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/support/scenes.h"

namespace drape::bench {
namespace {

using testing::HasSubstr;

TEST(MethodsTest, WordsSetFieldsOnTopOfThePreset) {
  const auto settings = ParseSettings("substeps=16 use_tethers=false preset=PAPER tolerance=0");
  ASSERT_TRUE(settings.ok()) << settings.status().ToString();
  StepSettings expected = PresetSettings(Preset::kPaper);
  expected.substeps = 16;
  expected.tolerance = 0;
  EXPECT_EQ(*settings, expected);
  EXPECT_EQ(*ParseSettings(""), PresetSettings(Preset::kRealtime));
}

TEST(MethodsTest, SettingsAndTheirTextAreTheSame) {
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime, Preset::kAccurate}) {
    StepSettings settings = PresetSettings(preset);
    settings.time_step_s = 1.0 / 77;
    const auto again = ParseSettings(SettingsText(settings));
    ASSERT_TRUE(again.ok()) << SettingsText(settings);
    EXPECT_EQ(*again, settings);
  }
}

TEST(MethodsTest, WordsThatMeanNothingAreNamedWithWhatIsLegal) {
  const auto message = [](const char* words) { return ParseSettings(words).status().ToString(); };
  EXPECT_THAT(message("sweeps=3"), HasSubstr("sweeps"));
  EXPECT_THAT(message("sweeps=3"), HasSubstr("max_iterations"));
  EXPECT_THAT(message("preset=FAST"), HasSubstr("PAPER | REALTIME | ACCURATE"));
  EXPECT_THAT(message("substeps=-1"), HasSubstr("'-1' is not a number"));
  EXPECT_THAT(message("substeps"), HasSubstr("substeps"));
  EXPECT_THAT(message("substeps=0"), HasSubstr("[1, "));
}

TEST(MethodsTest, NamesAreUniqueAndNoTwoMethodsDoTheSame) {
  const test::Scene hung = test::Grid(4, 4, 1, 1, {0, 3});
  const test::Scene loose = test::Grid(4, 4, 1, 1);
  const auto all = MethodsFor(hung, PointGrid::kFullAndFiner);
  std::set<std::string> names;
  for (const Method& method : all) names.insert(method.name);
  EXPECT_EQ(names.size(), all.size());
  EXPECT_EQ(all[0].name, "PAPER");
  EXPECT_EQ(all[1].settings, PresetSettings(Preset::kRealtime));
  // Nothing to tether: families that differ by tethers alone are one.
  EXPECT_LT(MethodsFor(loose, PointGrid::kFullAndFiner).size(), all.size());
  EXPECT_EQ(MethodsFor(hung, PointGrid::kPresets).size(), 3u);
}

}  // namespace
}  // namespace drape::bench
