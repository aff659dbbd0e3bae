// Every setting and every value of a choice changes what a cloth does, on every backend, in the
// scene that stands here for it. The list is that of kSettings: a new row without a case fails.
#include <google/protobuf/text_format.h>

#include <map>
#include <set>

#include "server/api/settings_message.h"
#include "server/scheduler/frame_budget.h"
#include "server/scheduler/sleep_watch.h"
#include "server/solver/load.h"
#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

// Hangs by two corners and is stretched by its motion: every stage has something to do.
Scene StirredSheet() {
  Scene scene = CompliantSheet(6, 1e-4);
  Stir(scene, 1);
  return scene;
}

// Inextensible: it is stretched by the errors that one sweep leaves.
Scene HungSheet() {
  return Grid(8, 8, 1, 1, {0, 7});
}

// Cells of 6 cm on a ball of 10 cm.
Scene SheetOnABall() {
  Scene scene = Grid(6, 6, 0.3, 0.3);
  scene.parameters.colliders = {SphereAt({0.15, -0.11, 0.14}, 0.1)};
  return scene;
}

// No particle gets farther than 1 m from where it was.
Scene SmallSheet() {
  return Grid(4, 4, 0.2, 0.2, {0, 3});
}

v1::StepSettings Parse(const std::string& text) {
  v1::StepSettings settings;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &settings)) << text;
  return settings;
}

struct SwitchCase {
  Scene (*scene)();
  std::string without;  // settings in text format; set beside them, the switch matters
  std::string with;     // empty for choices: each of their values is set in turn
  int steps = 5;

  // Later values replace earlier ones when messages are merged, not in text: merge.
  std::string WithBoth() const {
    v1::StepSettings both = Parse(without);
    both.MergeFrom(Parse(with));
    std::string text;
    google::protobuf::TextFormat::PrintToString(both, &text);
    return text;
  }
};

const std::map<std::string, SwitchCase, std::less<>>& Cases() {
  static const auto& cases = *new std::map<std::string, SwitchCase, std::less<>>{
      {"preset", {StirredSheet, "", ""}},
      {"time_step_s", {StirredSheet, "", "time_step_s: 0.01"}},
      {"substeps", {StirredSheet, "", "substeps: 30"}},
      {"max_iterations", {StirredSheet, "", "max_iterations: 3"}},
      // Far from converged the tolerance changes nothing: fifty sweeps.
      {"tolerance", {StirredSheet, "max_iterations: 50", "tolerance: 0.01"}},
      // The sheet has bending and shear springs.
      {"spring_integration", {StirredSheet, "substeps: 20", ""}},
      {"sweep", {StirredSheet, "", ""}},
      {"integration", {StirredSheet, "", ""}},
      // Substeps of 1.65 ms: shorter ones and longer ones make BLENDED one of the others.
      {"direction", {HungSheet, "integration: ONE_STEP time_step_s: 0.0132 substeps: 8", ""}},
      {"velocity_iterations", {HungSheet, "integration: ONE_STEP", "velocity_iterations: 2"}},
      {"twist_damping_per_s", {StirredSheet, "", "twist_damping_per_s: 300"}},
      {"refine_above_strain", {HungSheet, "substeps: 4", "refine_above_strain: 1e-6"}},
      // Not part of the step itself: the server raises the substeps.
      {"load_limit", {HungSheet, "load_limit: 0", "load_limit: 1e-6"}},
      // Nor this: the scheduler caps the sweeps, one as long as nothing is measured.
      {"frame_budget_ms", {StirredSheet, "max_iterations: 5", "frame_budget_ms: 1"}},
      // Nor this: the scheduler leaves steps out, here after a second.
      {"sleep_motion_m", {SmallSheet, "substeps: 2", "sleep_motion_m: 1", 80}},
      {"sleep_after_s", {SmallSheet, "substeps: 2 sleep_motion_m: 1", "sleep_after_s: 0.2", 80}},
      {"collider_contact", {SheetOnABall, "", ""}},
      {"use_tethers", {HungSheet, "use_tethers: true", "use_tethers: false"}},
  };
  return cases;
}

class Switches : public PhysicsTest {
 protected:
  // The scene with these settings, as a backend gets it.
  static Scene Resolved(const SwitchCase& one, const std::string& text) {
    Violations violations;
    Scene scene = one.scene();
    scene.parameters.settings = api::CheckSettings("settings", Parse(text), violations);
    EXPECT_TRUE(violations.is_empty()) << text;
    scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
    return scene;
  }

  // Without what the scheduler does around the steps.
  std::string BitsOfStages(const SwitchCase& one, const std::string& text) {
    const ClothHandle cloth = Make(Resolved(one, text));
    for (int step = 0; step < one.steps; ++step) {
      const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
      backend().Step({&item, 1});
    }
    return ReadBits(backend(), cloth);
  }

  std::string BitsAfter(const SwitchCase& one, const std::string& text) {
    const Scene scene = Resolved(one, text);
    const ClothHandle cloth = Make(scene);
    FrameBudget budget;
    budget.Set(scene.parameters.settings);
    SleepWatch sleep;
    sleep.Set(scene.parameters.settings);
    for (int step = 0; step < one.steps && !sleep.is_asleep(); ++step) {
      const StepItem item{
          .cloth = cloth, .pin_targets_m = {}, .measure = false, .max_iterations = budget.Cap()};
      const StepReport report = backend().Step({&item, 1}).reports.at(0);
      EXPECT_EQ(report.fault, FaultReason::kNone) << text;
      sleep.CompleteStep(report);
      if (!sleep.wants_look()) continue;
      sleep.Look(backend().Read({{&cloth, 1}, true, false}).positions_m, 0,
                 scene.model->particle_count());
    }
    return ReadBits(backend(), cloth);
  }
};

// Two different values of an enum never do the same; the unspecified one does what one of the
// others does.
void ExpectEachValueToMatter(const std::map<std::string, std::string>& bits_by_value,
                             const std::string& unspecified_bits) {
  std::set<std::string> distinct;
  for (const auto& [value, bits] : bits_by_value) {
    EXPECT_TRUE(distinct.insert(bits).second) << value << " does what another value does";
  }
  EXPECT_TRUE(distinct.contains(unspecified_bits));
}

TEST_P(Switches, EachOneChangesTheResultOfItsScene) {
  ForEachSetting([&](const auto& setting) {
    SCOPED_TRACE(setting.name);
    const auto found = Cases().find(setting.name);
    ASSERT_NE(found, Cases().end()) << "give this setting a scene where it changes the result";
    const SwitchCase& one = found->second;
    if (setting.value_names.empty()) {
      EXPECT_TRUE(BitsAfter(one, one.without) != BitsAfter(one, one.WithBoth()))
          << "changes nothing";
      return;
    }
    std::map<std::string, std::string> bits;
    for (const std::string_view value : setting.value_names) {
      const std::string choice = std::string(setting.name) + ": " + std::string(value);
      bits[std::string(value)] = BitsAfter(one, one.without + " " + choice);
    }
    ExpectEachValueToMatter(bits, BitsAfter(one, one.without));
  });
}

TEST_P(Switches, BackendsDoNotReadWhatIsTheSchedulers) {
  ForEachSetting([&](const auto& setting) {
    if (setting.reader != SettingReader::kScheduler) return;
    const SwitchCase& one = Cases().find(setting.name)->second;
    EXPECT_TRUE(BitsOfStages(one, one.without) == BitsOfStages(one, one.WithBoth()))
        << setting.name;
  });
}

TEST(SwitchesTest, TheListHasNoStrangers) {
  std::set<std::string_view> names;
  ForEachSetting([&](const auto& setting) { names.insert(setting.name); });
  for (const auto& [name, one] : Cases()) EXPECT_TRUE(names.contains(name)) << name;
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Switches);

}  // namespace
}  // namespace drape::test
