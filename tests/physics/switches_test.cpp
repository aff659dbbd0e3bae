// Every switch of StepSettings and every value of its enums changes what a cloth does, on every
// backend, in the scene that stands here for it. The list is walked from the protocol: a new field
// without a line fails.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <map>
#include <set>

#include "server/api/spec_validation.h"
#include "server/scheduler/frame_budget.h"
#include "server/scheduler/sleep_watch.h"
#include "server/solver/load.h"
#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;

// Hangs by two corners and is stretched by its motion: every stage has something to do.
Scene StirredSheet() {
  Scene scene = CompliantSheet(6, 1e-4);
  Stir(scene, 1);
  return scene;
}

// Inextensible: what stretches it is what one sweep leaves.
Scene HungSheet() {
  return Grid(8, 8, 1, 1, {0, 7});
}

// No particle gets farther than 1 m from where it was.
Scene SmallSheet() {
  return Grid(4, 4, 0.2, 0.2, {0, 3});
}

struct SwitchCase {
  Scene (*scene)();
  std::string without;  // settings in text format; set beside them, the switch matters
  std::string with;     // empty for enums: each of their values is set in turn
  int steps = 5;
};

const std::map<std::string, SwitchCase>& Cases() {
  static const auto& cases = *new std::map<std::string, SwitchCase>{
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
      // Not of the step itself: the server raises the substeps.
      {"load_limit", {HungSheet, "load_limit: 0", "load_limit: 1e-6"}},
      // Nor this: the scheduler caps the sweeps, one as long as nothing is measured.
      {"frame_budget_ms", {StirredSheet, "max_iterations: 5", "frame_budget_ms: 1"}},
      // Nor this: the scheduler leaves steps out, here after a second.
      {"sleep_motion_m", {SmallSheet, "substeps: 2", "sleep_motion_m: 1", 80}},
      {"use_tethers", {HungSheet, "use_tethers: true", "use_tethers: false"}},
  };
  return cases;
}

v1::StepSettings Parse(const std::string& text) {
  v1::StepSettings settings;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &settings)) << text;
  return settings;
}

class Switches : public PhysicsTest {
 protected:
  std::string BitsAfter(const SwitchCase& one, const std::string& text) {
    api::FieldChecks checks;
    Scene scene = one.scene();
    scene.parameters.settings = api::CheckSettings(api::FieldPath("settings"), Parse(text), checks);
    EXPECT_TRUE(checks.ok()) << text;
    scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
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
  const google::protobuf::Descriptor& settings = *v1::StepSettings::descriptor();
  for (int k = 0; k < settings.field_count(); ++k) {
    const FieldDescriptor& field = *settings.field(k);
    SCOPED_TRACE(field.full_name());
    const auto found = Cases().find(field.name());
    ASSERT_NE(found, Cases().end()) << "give this switch a scene where it changes the result";
    const SwitchCase& one = found->second;
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_ENUM) {
      // Later values replace earlier ones when messages are merged, not in text: merge.
      v1::StepSettings with = Parse(one.without);
      with.MergeFrom(Parse(one.with));
      std::string text;
      google::protobuf::TextFormat::PrintToString(with, &text);
      EXPECT_TRUE(BitsAfter(one, one.without) != BitsAfter(one, text)) << "changes nothing";
      continue;
    }
    std::map<std::string, std::string> bits;
    for (int v = 0; v < field.enum_type()->value_count(); ++v) {
      const auto& value = *field.enum_type()->value(v);
      if (value.number() == 0) continue;
      bits[value.name()] = BitsAfter(one, one.without + " " + field.name() + ": " + value.name());
    }
    EXPECT_GE(bits.size(), 2u);
    ExpectEachValueToMatter(bits, BitsAfter(one, one.without));
  }
}

TEST(SwitchesTest, TheListHasNoStrangers) {
  for (const auto& [name, one] : Cases()) {
    EXPECT_NE(v1::StepSettings::descriptor()->FindFieldByName(name), nullptr) << name;
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Switches);

}  // namespace
}  // namespace drape::test
