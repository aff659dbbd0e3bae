// The compared methods: settings of the step, as data. A family is a set of switches; its points
// are substeps x sweeps. A new switch of StepSettings is one line in the families.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/status.h"
#include "server/solver/step_settings.h"
#include "tests/support/scenes.h"

namespace drape::bench {

struct Method {
  std::string family;  // its points make one curve: "colours", "PAPER finer", ...
  std::string name;    // "colours 16x2" (substeps x sweeps), "REALTIME"
  StepSettings settings;
};

// "substeps=16 max_iterations=2 use_tethers=false": words of the fields of StepSettings, in any
// order, on top of REALTIME or of "preset=NAME". INVALID_ARGUMENT names an unknown word and the
// legal ones, or a value out of range.
Result<StepSettings> ParseSettings(std::string_view words);

// "mine: substeps=16 max_iterations=2" as a method; without "NAME:" the words are the name.
// std::runtime_error names what is wrong.
Method ParseMethod(const std::string& text);

// All fields, such that ParseSettings gives the settings back.
std::string SettingsText(const StepSettings& settings);

// The number of points of each family for a scene.
enum class PointGrid {
  kPresets,  // only the presets
  kFew,      // and two points of each family
  kCoarse,   // for scenes that take long
  kFull,
  kFullAndFiner,  // and the presets PAPER and ACCURATE at other substeps
};

// The presets first. Settings that do the same as earlier ones for this scene (tethers without
// pins) are left out.
std::vector<Method> MethodsFor(const test::Scene& scene, PointGrid grid);

// The words of each family that are not its points: "use_tethers=false", ...
std::vector<std::string> SwitchesOfFamilies();

// The preset at other numbers of substeps, its other settings as they are; the family is
// "PRESET finer".
std::vector<Method> FinerPreset(Preset preset, std::span<const uint32_t> substeps);

}  // namespace drape::bench
