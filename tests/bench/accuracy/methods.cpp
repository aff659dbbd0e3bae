#include "tests/bench/accuracy/methods.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>
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

// A field of StepSettings as a word: how it is read (false: not a value of it) and written.
struct Word {
  std::string legal;
  std::function<bool(std::string_view, StepSettingsOverrides&)> read;
  std::function<std::string(const StepSettings&)> write;
};

template <class Number>
bool ReadNumber(std::string_view text, std::optional<Number>& value) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) return false;
  value = number;
  return true;
}

std::string NumberText(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

template <class Value>
using Names = std::vector<std::pair<std::string_view, Value>>;

template <class Value>
Word NamedWord(const Names<Value>& names, std::optional<Value> StepSettingsOverrides::*override_of,
               Value StepSettings::*field) {
  std::string legal;
  for (const auto& [name, value] : names) legal += (legal.empty() ? "" : " | ") + std::string(name);
  const auto read = [=](std::string_view text, StepSettingsOverrides& overrides) {
    for (const auto& [name, value] : names) {
      if (name == text) overrides.*override_of = value;
    }
    return (overrides.*override_of).has_value();
  };
  const auto write = [=](const StepSettings& settings) {
    for (const auto& [name, value] : names) {
      if (value == settings.*field) return std::string(name);
    }
    DRAPE_CHECK(false, "a value without a name");
    return std::string();
  };
  return {legal, read, write};
}

template <class Number>
Word NumberWord(std::optional<Number> StepSettingsOverrides::*override_of,
                Number StepSettings::*field) {
  return {"a number",
          [=](std::string_view text, StepSettingsOverrides& overrides) {
            return ReadNumber(text, overrides.*override_of);
          },
          [=](const StepSettings& settings) {
            return NumberText(static_cast<double>(settings.*field));
          }};
}

const std::map<std::string, Word, std::less<>>& Words() {
  using O = StepSettingsOverrides;
  using S = StepSettings;
  static const std::map<std::string, Word, std::less<>> words = {
      {"preset", NamedWord<Preset>({{"PAPER", Preset::kPaper},
                                    {"REALTIME", Preset::kRealtime},
                                    {"ACCURATE", Preset::kAccurate}},
                                   &O::preset, &S::preset)},
      {"time_step_s", NumberWord<double>(&O::time_step_s, &S::time_step_s)},
      {"substeps", NumberWord<uint32_t>(&O::substeps, &S::substeps)},
      {"max_iterations", NumberWord<uint32_t>(&O::max_iterations, &S::max_iterations)},
      {"tolerance", NumberWord<double>(&O::tolerance, &S::tolerance)},
      {"spring_integration",
       NamedWord<SpringIntegration>({{"IN_FORCE", SpringIntegration::kInForce},
                                     {"HALF_KICKS", SpringIntegration::kHalfKicks}},
                                    &O::spring_integration, &S::spring_integration)},
      {"integration", NamedWord<Integration>({{"ONE_STEP", Integration::kOneStep},
                                              {"TWO_STEP", Integration::kTwoStep}},
                                             &O::integration, &S::integration)},
      {"direction", NamedWord<Direction>({{"AT_END", Direction::kAtEnd},
                                          {"AT_START", Direction::kAtStart},
                                          {"BLENDED", Direction::kBlended}},
                                         &O::direction, &S::direction)},
      {"velocity_iterations",
       NumberWord<uint32_t>(&O::velocity_iterations, &S::velocity_iterations)},
      {"sweep", NamedWord<Sweep>({{"COLOURS", Sweep::kColours}, {"STRIPS", Sweep::kStrips}},
                                 &O::sweep, &S::sweep)},
      {"load_limit", NumberWord<double>(&O::load_limit, &S::load_limit)},
      {"refine_above_strain", NumberWord<double>(&O::refine_above_strain, &S::refine_above_strain)},
      {"twist_damping_per_s", NumberWord<double>(&O::twist_damping_per_s, &S::twist_damping_per_s)},
      {"use_tethers",
       NamedWord<bool>({{"true", true}, {"false", false}}, &O::use_tethers, &S::use_tethers)},
  };
  return words;
}

std::string LegalWords() {
  std::string legal;
  for (const auto& [name, word] : Words()) legal += (legal.empty() ? "" : ", ") + name;
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

// The settings that act on the scene's cloth: a switch that has nothing to do is off.
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
  std::vector<FieldViolation> violations;
  for (std::string word; stream >> word;) {
    const size_t equals = std::min(word.find('='), word.size());
    const std::string name = word.substr(0, equals);
    const std::string value = word.substr(std::min(equals + 1, word.size()));
    const auto found = Words().find(name);
    if (found == Words().end()) {
      violations.push_back({name, "is none of: " + LegalWords()});
    } else if (!found->second.read(value, overrides)) {
      violations.push_back({name, "'" + value + "' is not " + found->second.legal});
    }
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
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
  for (const auto& [name, word] : Words()) {
    text += (text.empty() ? "" : " ") + name + "=" + word.write(settings);
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
    settings.load_limit = 0;  // exactly as many as asked for
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
      settings.load_limit = 0;  // exactly as many as asked for
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
