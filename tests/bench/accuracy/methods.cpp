#include "tests/bench/accuracy/methods.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <sstream>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "server/core/check.h"
#include "server/solver/step_plan.h"

namespace drape::bench {
namespace {

// The switches. Substeps and sweeps come from the grid.
struct Family {
  const char* name;
  const char* words;
};
constexpr Family kFamilies[] = {
    {"colours",
     "integration=ONE_STEP direction=AT_END sweep=COLOURS use_tethers=false twist_damping_per_s=0 "
     "refine_above_strain=0"},
    {"colours + tethers",
     "integration=ONE_STEP direction=AT_END sweep=COLOURS use_tethers=true twist_damping_per_s=0 "
     "refine_above_strain=0"},
    {"start directions + colours",
     "integration=ONE_STEP direction=BLENDED sweep=COLOURS use_tethers=false "
     "twist_damping_per_s=0 refine_above_strain=0"},
    {"strips",
     "integration=ONE_STEP direction=AT_END sweep=STRIPS use_tethers=false twist_damping_per_s=0 "
     "refine_above_strain=0"},
    {"start directions + strips",
     "integration=ONE_STEP direction=BLENDED sweep=STRIPS use_tethers=false "
     "twist_damping_per_s=0 refine_above_strain=0"},
    {"start directions + strips + tethers + twist",
     "integration=ONE_STEP direction=BLENDED sweep=STRIPS use_tethers=true "
     "twist_damping_per_s=150 refine_above_strain=0"},
    {"two steps + strips",
     "integration=TWO_STEP sweep=STRIPS use_tethers=false twist_damping_per_s=0 "
     "refine_above_strain=0"},
    {"two steps + strips + tethers",
     "integration=TWO_STEP sweep=STRIPS use_tethers=true twist_damping_per_s=0 "
     "refine_above_strain=0"},
    {"two steps + strips + tethers + twist",
     "integration=TWO_STEP sweep=STRIPS use_tethers=true twist_damping_per_s=150 "
     "refine_above_strain=0"},
    {"two steps + strips + tethers + twist + refinement",
     "integration=TWO_STEP sweep=STRIPS use_tethers=true twist_damping_per_s=150 "
     "refine_above_strain=0.002"},
};

struct Point {
  uint32_t substeps;
  uint32_t sweeps;
};
constexpr Point kFewPoints[] = {{16, 2}, {60, 1}};
constexpr Point kCoarsePoints[] = {{1, 100}, {16, 1}, {16, 2}, {32, 1}, {60, 1}, {100, 1}};
constexpr Point kFullPoints[] = {{1, 100}, {4, 1},  {4, 10}, {8, 1},  {8, 4},  {16, 1},  {16, 2},
                                 {16, 6},  {32, 1}, {32, 3}, {60, 1}, {60, 2}, {100, 1}, {200, 1}};
constexpr uint32_t kFinerPaper[] = {2, 4, 8, 16, 32, 64, 256, 1024};
constexpr uint32_t kFinerAccurate[] = {2, 4, 8, 16, 32, 120};

constexpr std::array kPresets = {Preset::kPaper, Preset::kRealtime, Preset::kAccurate};

// The settings of a method: benchmarks step backends, without the scheduler.
template <class Visit>
void ForEachWord(Visit&& visit) {
  ForEachSetting([&](const auto& setting) {
    if (setting.reader != SettingReader::kScheduler) visit(setting);
  });
}

// Each reads the value of a setting; false: not a value of it.
template <class Value>
requires std::is_arithmetic_v<Value>
bool Read(std::string_view text, const Setting<Value>& setting, StepSettingsOverrides& overrides) {
  Value number{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) return false;
  overrides.Set(setting.member, number);
  return true;
}

bool Read(std::string_view text, const Setting<bool>& setting, StepSettingsOverrides& overrides) {
  if (text != "true" && text != "false") return false;
  overrides.Set(setting.member, text == "true");
  return true;
}

template <class Value>
requires std::is_enum_v<Value>
bool Read(std::string_view text, const Setting<Value>& setting, StepSettingsOverrides& overrides) {
  const auto found = std::ranges::find(setting.value_names, text);
  if (found == setting.value_names.end()) return false;
  overrides.Set(setting.member, static_cast<Value>(found - setting.value_names.begin()));
  return true;
}

template <class Value>
std::string LegalText(const Setting<Value>& setting) {
  if constexpr (std::is_same_v<Value, bool>) return "true | false";
  std::string legal;
  for (const std::string_view name : setting.value_names) {
    legal += (legal.empty() ? "" : " | ") + std::string(name);
  }
  return legal.empty() ? "a number" : legal;
}

template <class Value>
std::string ValueText(const Setting<Value>& setting, Value value) {
  if constexpr (std::is_same_v<Value, bool>) return value ? "true" : "false";
  if constexpr (std::is_enum_v<Value>) {
    return std::string(setting.value_names[static_cast<size_t>(value)]);
  } else {
    return NumberText(static_cast<double>(value));
  }
}

// By name.
std::map<std::string, std::string> Words(const StepSettings& settings) {
  std::map<std::string, std::string> words;
  ForEachWord([&](const auto& setting) {
    words.emplace(setting.name, ValueText(setting, settings.*setting.member));
  });
  return words;
}

std::string LegalWords() {
  std::string legal;
  for (const auto& [name, value] : Words({})) legal += (legal.empty() ? "" : ", ") + name;
  return legal;
}

// The settings that the words set; `preset` first, wherever it stands.
StepSettings MustParse(const std::string& words) {
  const Result<StepSettings> settings = ParseSettings(words);
  DRAPE_CHECK(settings.ok(), settings.status().ToString());
  return *settings;
}

std::span<const Point> PointsOf(PointGrid grid) {
  switch (grid) {
    case PointGrid::kPresets:
      return {};
    case PointGrid::kFew:
      return kFewPoints;
    case PointGrid::kCoarse:
      return kCoarsePoints;
    case PointGrid::kFull:
    case PointGrid::kFullAndFiner:
      return kFullPoints;
  }
  return {};
}

// The settings that act on the scene's cloth: a switch without effect is off.
StepSettings EffectiveSettings(StepSettings settings, const test::Scene& scene) {
  const SceneModel& model = *scene.model;
  ClothParameters parameters = scene.parameters;
  parameters.settings = settings;
  const StepPlan plan = PlanStep(model, parameters, LengthSource::kModel, ScalarType::kFloat32);
  const SolverChoice& solver = plan.solver;
  settings.use_tethers = plan.Has(StepStage::kTether);
  if (!plan.Has(StepStage::kDampTwist)) settings.twist_damping_per_s = 0;
  settings.refine_above_strain = solver.refine_above_strain;
  if (!solver.has_two_steps) settings.integration = Integration::kOneStep;
  if (solver.end_share == 1) settings.direction = Direction::kAtEnd;
  if (solver.end_share == 0) settings.direction = Direction::kAtStart;
  settings.preset = Preset::kRealtime;  // only the name of the rest
  if (model.spring_count() == 0) settings.spring_integration = SpringIntegration::kHalfKicks;
  return settings;
}

}  // namespace

Result<StepSettings> ParseSettings(std::string_view text) {
  StepSettingsOverrides overrides;
  std::istringstream stream{std::string(text)};
  Violations violations;
  for (std::string word; stream >> word;) {
    const size_t equals = std::min(word.find('='), word.size());
    const std::string name = word.substr(0, equals);
    const std::string value = word.substr(std::min(equals + 1, word.size()));
    bool is_known = false;
    ForEachWord([&](const auto& setting) {
      if (setting.name != name) return;
      is_known = true;
      violations.Require(Read(value, setting, overrides), FieldPath(setting.name),
                         [&] { return "'" + value + "' is not " + LegalText(setting); });
    });
    violations.Require(is_known, FieldPath(name), [] { return "is none of: " + LegalWords(); });
  }
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return ResolveSettings(overrides, "settings");
}

Method ParseMethod(const std::string& text) {
  const size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  const std::string words = colon == std::string::npos ? text : text.substr(colon + 1);
  const Result<StepSettings> settings = ParseSettings(words);
  if (!settings.ok()) {
    throw std::runtime_error("--method '" + text + "': " + settings.status().ToString());
  }
  if (text.find_first_of(",\"\n") != std::string::npos) {
    throw std::runtime_error("--method '" + text + "': no commas and quotes");
  }
  return {name, name, *settings};
}

std::string SettingsText(const StepSettings& settings) {
  std::string text;
  for (const auto& [name, value] : Words(settings)) {
    text += (text.empty() ? "" : " ") + name + "=" + value;
  }
  return text;
}

std::vector<std::string> SwitchesOfFamilies() {
  std::vector<std::string> switches;
  for (const Family& family : kFamilies) switches.emplace_back(family.words);
  return switches;
}

std::vector<Method> FinerPreset(Preset preset, std::span<const uint32_t> substeps) {
  std::vector<Method> methods;
  const std::string name(PresetName(preset));
  for (const uint32_t count : substeps) {
    StepSettings settings = PresetSettings(preset);
    settings.substeps = count;
    settings.load_limit = 0;  // exactly the requested number
    methods.push_back({name + " finer", name + " substeps=" + std::to_string(count), settings});
  }
  return methods;
}

std::vector<Method> MethodsFor(const test::Scene& scene, PointGrid grid) {
  std::vector<Method> candidates;
  for (const Preset preset : kPresets) {
    const std::string name(PresetName(preset));
    candidates.push_back({name, name, PresetSettings(preset)});
  }
  for (const Family& family : kFamilies) {
    for (const Point& point : PointsOf(grid)) {
      StepSettings settings = MustParse(std::string("tolerance=0 ") + family.words);
      settings.substeps = point.substeps;
      settings.load_limit = 0;  // exactly the requested number
      settings.max_iterations = point.sweeps;
      const std::string name = std::string(family.name) + " " + std::to_string(point.substeps) +
                               "x" + std::to_string(point.sweeps);
      candidates.push_back({family.name, name, settings});
    }
  }
  if (grid == PointGrid::kFullAndFiner) {
    for (Method& method : FinerPreset(Preset::kPaper, kFinerPaper)) candidates.push_back(method);
    for (Method& method : FinerPreset(Preset::kAccurate, kFinerAccurate)) {
      candidates.push_back(method);
    }
  }
  std::vector<Method> methods;
  std::vector<StepSettings> seen;
  for (Method& method : candidates) {
    const StepSettings effective = EffectiveSettings(method.settings, scene);
    const bool is_preset = methods.size() < kPresets.size();
    if (!is_preset && std::find(seen.begin(), seen.end(), effective) != seen.end()) continue;
    seen.push_back(effective);
    methods.push_back(std::move(method));
  }
  return methods;
}

}  // namespace drape::bench
