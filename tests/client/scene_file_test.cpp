#include "drape/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::TemporaryFolder;
using client_test::WriteText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kGrid[] = R"("grid": {"columns": 2, "rows": 2, "width_m": 1, "height_m": 1})";

// A scene with one cloth; `spec` and `rest` begin with a comma when they are not empty.
std::string Scene(const std::string& spec = "", const std::string& rest = "") {
  return R"({"duration_s": 1, "cloths": [{"spec": {)" + std::string(kGrid) + spec + "}}]" + rest +
         "}";
}

v1::Scene Parse(const std::string& text, const std::vector<std::string>& sets = {}) {
  return ParseScene(text, ".", sets);
}

// The message of the refusal: begins with the path of the field.
std::string Refusal(const std::string& text, const std::vector<std::string>& sets = {}) {
  const ErrorDetails details = ErrorOf([&] { Parse(text, sets); });
  EXPECT_EQ(details.code, ErrorCode::kInvalidArgument) << details.message;
  return details.message;
}

TEST(SceneFileTest, ReadsTheMessage) {
  const v1::Scene scene =
      Parse(Scene(R"(, "material": {"friction_static": 0.5}, "settings": {"preset": "ACCURATE"})",
                  R"(, "name": "one", "time_step_s": 0.01,
                "controls": [{"time_s": 0.5, "gravity_m_per_s2": [0, -1, 0]}])"));
  EXPECT_EQ(scene.name(), "one");
  EXPECT_EQ(scene.cloths(0).spec().grid().columns(), 2u);
  EXPECT_EQ(scene.cloths(0).spec().material().friction_static(), 0.5);
  EXPECT_EQ(scene.cloths(0).spec().settings().preset(), v1::StepSettings::ACCURATE);
  EXPECT_THAT(scene.controls(0).gravity_m_per_s2(), ElementsAre(0, -1, 0));
  EXPECT_EQ(StepCount(scene), 100u);
}

TEST(SceneFileTest, NumbersKeepEveryBit) {
  const v1::Scene scene = Parse(Scene(R"(, "material": {"damping_per_s": 0.1234567890123456789})"));
  EXPECT_EQ(scene.cloths(0).spec().material().damping_per_s(), 0.1234567890123456789);
}

TEST(SceneFileTest, TheTimeStepAppliesToEveryCloth) {
  EXPECT_EQ(Parse(Scene()).time_step_s(), 1.0 / 60);
  EXPECT_EQ(Parse(Scene()).cloths(0).spec().settings().time_step_s(), 1.0 / 60);
  EXPECT_EQ(StepCount(Parse(Scene())), 60u);
  const v1::Scene scene = Parse(Scene("", R"(, "time_step_s": 0.02)"));
  EXPECT_EQ(scene.cloths(0).spec().settings().time_step_s(), 0.02);
  EXPECT_EQ(StepCount(scene), 50u);
  // --set replaces it for the whole scene; a spec may not differ.
  const v1::Scene overridden =
      Parse(Scene("", R"(, "time_step_s": 0.02)"), {"settings.time_step_s=0.5"});
  EXPECT_EQ(overridden.time_step_s(), 0.5);
  EXPECT_EQ(StepCount(overridden), 2u);
  EXPECT_THAT(Refusal(Scene(R"(, "settings": {"time_step_s": 0.1})")),
              StartsWith("cloths[0].spec.settings.time_step_s: "));
}

TEST(SceneFileTest, StepsAreRoundedNotCut) {
  // 5 / 0.0166667 = 299.9994: 300 steps.
  EXPECT_EQ(StepCount(Parse(R"({"duration_s": 5, "time_step_s": 0.0166667, "cloths": [{"spec": {)" +
                            std::string(kGrid) + "}}]}")),
            300u);
}

struct BadScene {
  std::string text;
  std::string message;  // how it begins
};

class SceneFileRefusalTest : public ::testing::TestWithParam<BadScene> {};

TEST_P(SceneFileRefusalTest, NamesTheField) {
  EXPECT_THAT(Refusal(GetParam().text), StartsWith(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Fields, SceneFileRefusalTest,
    ::testing::Values(
        BadScene{Scene(R"(, "wind": 1)"), "cloths[0].spec.wind: unknown field"},
        BadScene{Scene("", R"(, "wobble": 1)"), "wobble: unknown field"},
        BadScene{Scene(R"(, "material": {"frictionStatic": 1})"),
                 "cloths[0].spec.material.frictionStatic: unknown field; did you mean "
                 "friction_static?"},
        BadScene{Scene(R"(, "environment": {"gravity_m_per_s2": [[0, -9.81, 0]]})"),
                 "cloths[0].spec.environment.gravity_m_per_s2[0]: a list inside a list"},
        BadScene{R"({"cloths": [{"spec": {"particles": {"positions_m": [0, 1, 2, [3, 4, 5]]}}}]})",
                 "cloths[0].spec.particles.positions_m[3]: a list inside a list"},
        BadScene{Scene(R"(, "environment": {"gravity_m_per_s2": 9.81})"),
                 "cloths[0].spec.environment.gravity_m_per_s2: must be a list"},
        BadScene{Scene(R"(, "scale_m": [1])"), "cloths[0].spec.scale_m: must be a single value"},
        BadScene{Scene(R"(, "scale_m": "big")"), "cloths[0].spec.scale_m: must be a number"},
        BadScene{Scene(R"(, "scale_m": 2)"), "cloths[0].spec.scale_m: needs mesh_file"},
        BadScene{Scene(R"(, "pins": [{"particle": -1}])"),
                 "cloths[0].spec.pins[0].particle: must be a whole number"},
        BadScene{Scene(R"(, "pins": [{"particle": 1.5}])"),
                 "cloths[0].spec.pins[0].particle: must be a whole number"},
        BadScene{Scene(R"(, "pins": [{"particle": 4294967296}])"),
                 "cloths[0].spec.pins[0].particle: must be a whole number"},
        BadScene{Scene(R"(, "pins": 3)"), "cloths[0].spec.pins: must be a list"},
        BadScene{Scene(R"(, "settings": {"preset": "FAST"})"),
                 "cloths[0].spec.settings.preset: must be one of PAPER, REALTIME, ACCURATE"},
        BadScene{Scene(R"(, "settings": {"preset": 17})"),
                 "cloths[0].spec.settings.preset: must be one of"},
        BadScene{Scene(R"(, "mesh_file": "a.obj")"), "cloths[0].spec.mesh_file: only one of"},
        BadScene{Scene(R"(, "mesh_file": 3)"), "cloths[0].spec.mesh_file: must be a string"},
        BadScene{Scene(R"(, "meshFile": "a.obj")"),
                 "cloths[0].spec.meshFile: unknown field; did you mean mesh_file?"},
        BadScene{Scene(R"(, "material": {"scale_m": 1})"),
                 "cloths[0].spec.material.scale_m: unknown field"},
        BadScene{Scene(R"(, "material": 3)"), "cloths[0].spec.material: must be an object"},
        BadScene{Scene("", R"(, "name": 3)"), "name: must be a string"},
        BadScene{Scene("", R"(, "name": "a", "name": "b")"), "name: is given twice"},
        BadScene{Scene("", R"(, "time_step_s": 0)"), "time_step_s: must be > 0"},
        BadScene{Scene("", R"(, "time_step_s": "NaN")"), "time_step_s: must be > 0"},
        BadScene{R"({"duration_s": -1, "cloths": []})", "duration_s: must be >= 0"},
        BadScene{R"({"duration_s": 1e300, "cloths": []})", "duration_s: must be at most"},
        BadScene{R"({"duration_s": 1})", "cloths: must have at least one"},
        BadScene{R"({"cloths": [{"spec": {}}]})", "cloths[0].spec: must have one of grid"},
        BadScene{R"({"cloths": [{"spec": {"grid": {"columns": 65536, "rows": 65536}}}]})",
                 "cloths[0].spec.grid: makes more than 16777216 particles"},
        BadScene{R"({"cloths": [{"count": 0}]})", "cloths[0].count: must be at least 1"},
        BadScene{R"({"cloths": [{"count": 4294967295, "spec": {"grid": {}}}]})",
                 "cloths[0].count: makes more than 1000000 cloths"},
        BadScene{
            R"({"cloths": [{"count": 1000000, "spec": {"grid": {}}}, {"spec": {"grid": {}}}]})",
            "cloths[1].count: makes more than 1000000 cloths"},
        BadScene{R"({"cloths": [3]})", "cloths[0]: must be an object"},
        BadScene{"[]", "Scene: must be an object"},
        BadScene{Scene("", R"(, "controls": [{"time_s": -1}])"),
                 "controls[0].time_s: must be >= 0"},
        BadScene{Scene("", R"(, "controls": [{"cloths": [0, 1]}])"),
                 "controls[0].cloths[1]: must be below the number of cloths, 1, got 1"},
        BadScene{Scene("", R"(, "controls": [{"cloths": [0, 0], "wind_m_per_s": [1, 0, 0]}])"),
                 "controls[0].cloths[1]: 0 is given twice"},
        BadScene{Scene("", R"(, "controls": [{"grips": [{"target_m": [1, 0, 0]}]}])"),
                 "controls[0].grips[0].action: must be one of HOLD, "},
        BadScene{Scene("", R"(, "controls": [{"gravity_m_per_s2": [1, 2]}])"),
                 "controls[0].gravity_m_per_s2: must have 3 numbers, got 2"},
        BadScene{Scene("", R"(, "controls": [{"wind_m_per_s": [1]}])"),
                 "controls[0].wind_m_per_s: must have 3 numbers, got 1"},
        BadScene{Scene(R"(, "pins": [{"particle": 1}])",
                       R"(, "controls": [{"pin_targets": [{"particle": 1}]}])"),
                 "controls[0].pin_targets[0].target_m: must have 3 numbers, got 0"},
        BadScene{Scene("", R"(, "controls": [{"collider_targets": [{"collider": 0}]}])"),
                 "controls[0].collider_targets[0].position_m: must have 3 numbers, got 0"},
        BadScene{Scene("", R"(, "controls": [{"collider_targets": [{"position_m": [0,0,0]}]}])"),
                 "controls[0].collider_targets[0].collider: collider 0 is not one of the 0 of "
                 "cloths[0]"},
        BadScene{Scene("", R"(, "controls": [{"grips": [{"action": "HOLD"}]}])"),
                 "controls[0].grips[0].target_m: must have 3 numbers, got 0"},
        BadScene{Scene("", R"(, "controls": [{"grips": [{"action": "RELEASE"}]}])"),
                 "controls[0].grips[0].slot: must be below max_grips of cloths[0], 0, got 0"},
        BadScene{
            Scene(R"(, "max_grips": 1)", R"(, "controls": [{"grips": [)"
                                         R"({"action": "GRAB_NEAREST", "target_m": [0,0,0]}]}])"),
            "controls[0].grips[0].radius_m: must be > 0, got 0"},
        BadScene{Scene("", R"(, "controls": [{"rest_lengths": [{"constraint": 0}]}])"),
                 "controls[0].rest_lengths[0].rest_length_m: must be > 0, got 0"},
        BadScene{Scene("", R"(, "controls": [{"rest_length_scale": {"scale": 2, "over_s": -1}}])"),
                 "controls[0].rest_length_scale.over_s: must be >= 0, got -1"},
        BadScene{
            Scene(R"(, "pins": [{"particle": 1}])",
                  R"(, "controls": [{"pin_targets": [{"particle": 2, "target_m": [0,0,0]}]}])"),
            "controls[0].pin_targets[0].particle: particle 2 is not a pin of cloths[0]"}));

TEST(SceneFileTest, JsonIsStrict) {
  for (const char* text : {"{\"duration_s\": 1, // a comment\n\"cloths\": []}", "{\"cloths\": [],}",
                           "{", "", "{\"duration_s\": nan}"}) {
    const ErrorDetails details = ErrorOf([&] { Parse(text); });
    EXPECT_EQ(details.reason, "BAD_JSON") << text;
    EXPECT_THAT(details.message, Not(HasSubstr("json.exception"))) << "the library's own word";
  }
}

TEST(SceneFileTest, SetReachesEveryClothAndOverrides) {
  const std::string text = R"({"cloths": [{"spec": {)" + std::string(kGrid) +
                           R"(, "settings": {"substeps": 2}}}, {"spec": {)" + kGrid +
                           R"(, "pins": [{"particle": 0}]}}]})";
  const v1::Scene scene =
      Parse(text, {"settings.substeps=8", "material.damping_per_s=0.1", "settings.preset=PAPER",
                   "environment.gravity_m_per_s2=[0,-1,0]"});
  for (const v1::SceneCloth& cloth : scene.cloths()) {
    EXPECT_EQ(cloth.spec().settings().substeps(), 8u);
    EXPECT_EQ(cloth.spec().settings().preset(), v1::StepSettings::PAPER);
    EXPECT_EQ(cloth.spec().material().damping_per_s(), 0.1);
    EXPECT_THAT(cloth.spec().environment().gravity_m_per_s2(), ElementsAre(0, -1, 0));
  }
}

TEST(SceneFileTest, SetReachesIntoLists) {
  const v1::Scene scene =
      Parse(Scene(R"(, "pins": [{"particle": 0}])"), {"pins.0.particle=3", "pins.1.particle=1"});
  ASSERT_EQ(scene.cloths(0).spec().pins_size(), 2);
  EXPECT_EQ(scene.cloths(0).spec().pins(0).particle(), 3u);
  EXPECT_EQ(scene.cloths(0).spec().pins(1).particle(), 1u);
}

TEST(SceneFileTest, ABadSetIsRefused) {
  EXPECT_THAT(Refusal(Scene(), {"settings.wobble=8"}),
              StartsWith("cloths[0].spec.settings.wobble: unknown field"));
  EXPECT_THAT(Refusal(Scene(), {"settings.substeps=many"}),
              StartsWith("cloths[0].spec.settings.substeps: must be a whole number"));
  EXPECT_THAT(Refusal(Scene(), {"settings.substeps"}), HasSubstr("PATH=VALUE"));
  EXPECT_THAT(Refusal(Scene(), {"settings..substeps=1"}), HasSubstr("empty name"));
  EXPECT_THAT(Refusal(Scene(), {"grid.columns.x=1"}), HasSubstr("has no members"));
  EXPECT_THAT(Refusal(Scene(R"(, "pins": [])"), {"pins.1.particle=1"}), HasSubstr("not an index"));
}

TEST(SceneFileTest, MeshFilesAreReadBesideTheSceneFile) {
  const TemporaryFolder folder;
  WriteText(folder / "one.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  WriteText(folder / "one.json",
            R"({"cloths": [{"spec": {"mesh_file": "one.obj", "scale_m": 2}}]})");
  const v1::Scene scene = LoadScene(folder / "one.json");
  EXPECT_EQ(scene.name(), "one");
  EXPECT_TRUE(scene.cloths(0).spec().has_mesh());
  double x = 0;
  std::memcpy(&x, scene.cloths(0).spec().mesh().positions_m().data().data() + 3 * sizeof(x),
              sizeof(x));
  EXPECT_EQ(x, 2);
}

TEST(SceneFileTest, MeshFilesOfCollidersAreReadToo) {
  const TemporaryFolder folder;
  WriteText(folder / "one.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  const std::string head = R"({"cloths": [{"spec": {"grid": {"columns": 2, "rows": 2},
                                                    "environment": {"colliders": [)";
  WriteText(folder / "one.json", head + R"({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}},
                      {"mesh_file": "one.obj", "scale_m": 3,
                       "transform": {"position_m": [0, 1, 0]}}]}}}]})");
  const v1::Scene scene = LoadScene(folder / "one.json");
  const v1::Collider& collider = scene.cloths(0).spec().environment().colliders(1);
  ASSERT_TRUE(collider.has_mesh());
  EXPECT_EQ(collider.transform().position_m(1), 1);
  double x = 0;
  std::memcpy(&x, collider.mesh().positions_m().data().data() + 3 * sizeof(x), sizeof(x));
  EXPECT_EQ(x, 3);

  const auto refusal = [&](const std::string& collider_json) {
    return ErrorOf([&] { ParseScene(head + collider_json + "]}}}]}", folder.path()); }).message;
  };
  EXPECT_THAT(refusal(R"({"mesh_file": "gone.obj"})"),
              HasSubstr("cloths[0].spec.environment.colliders[0].mesh_file: no mesh file"));
  EXPECT_THAT(refusal(R"({"mesh_file": "one.obj", "scale_m": 0})"),
              StartsWith("cloths[0].spec.environment.colliders[0].scale_m: must be > 0"));
  EXPECT_THAT(refusal(R"({"plane": {}, "scale_m": 2})"),
              StartsWith("cloths[0].spec.environment.colliders[0].scale_m: needs mesh_file"));
  EXPECT_THAT(refusal(R"({"plane": {}, "mesh_file": "one.obj"})"), HasSubstr("only one of"));
}

TEST(SceneFileTest, SaysWhichFileIsMissing) {
  const TemporaryFolder folder;
  const ErrorDetails no_scene = ErrorOf([&] { LoadScene(folder / "nowhere.json"); });
  EXPECT_EQ(no_scene.reason, "NO_SCENE_FILE");
  EXPECT_THAT(no_scene.message, HasSubstr("nowhere.json"));

  WriteText(folder / "scene.json", R"({"cloths": [{"spec": {"mesh_file": "gone.obj"}}]})");
  const ErrorDetails no_mesh = ErrorOf([&] { LoadScene(folder / "scene.json"); });
  EXPECT_EQ(no_mesh.code, ErrorCode::kNotFound);
  EXPECT_THAT(no_mesh.message, HasSubstr("scene.json: cloths[0].spec.mesh_file: no mesh file"));
  EXPECT_THAT(no_mesh.message, HasSubstr("gone.obj"));
}

TEST(SceneFileTest, ControlsBeginWithTheFirstStepAtOrAfterThem) {
  EXPECT_EQ(FirstStepAtOrAfter(0, 0.1), 0u);
  EXPECT_EQ(FirstStepAtOrAfter(0.05, 0.1), 1u);
  EXPECT_EQ(FirstStepAtOrAfter(0.1001, 0.1), 2u);
  // Whole numbers of steps whose products round up (0.3 = 3 * 0.1 - ...) or down.
  for (uint64_t step = 0; step < 1000; ++step) {
    for (const double time_step_s : {0.1, 0.7, 1.0 / 60, 0.0166667}) {
      EXPECT_EQ(FirstStepAtOrAfter(static_cast<double>(step) * time_step_s, time_step_s), step);
    }
  }
  EXPECT_EQ(FirstStepAtOrAfter(2.1, 0.7), 3u);  // 3 * 0.7 < 2.1 in double precision
}

}  // namespace
}  // namespace drape
