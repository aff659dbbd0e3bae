#include "tests/bench/speed/curve_settings.h"

#include <string>

#include "server/core/check.h"

namespace drape::bench {
namespace {

struct Family {
  const char* name;
  const char* words;  // as of ParseSettings
  std::vector<uint32_t> substeps;
};

const std::vector<Family>& Families() {
  static const std::vector<Family> families = {
      {"REALTIME", "tolerance=0", {8, 10, 14, 20, 24, 28, 32, 36, 40, 46, 52, 60, 75, 104, 150}},
      {"REALTIME without refinement", "refine_above_strain=0", {10, 20, 30, 40, 52, 75, 104}},
      {"REALTIME + coarse refinement", "refine_above_strain=0.006", {9, 10, 12, 14, 20}},
      {"one step + strips + tethers + refinement",
       "integration=ONE_STEP direction=AT_END twist_damping_per_s=0 refine_above_strain=0.01",
       {8, 9, 10, 12, 16, 24}},
      {"one step + strips + tethers + coarse refinement",
       "integration=ONE_STEP direction=AT_END twist_damping_per_s=0 refine_above_strain=0.03",
       {4, 5, 6}},
      {"strips + tethers",
       "integration=ONE_STEP direction=AT_END sweep=STRIPS use_tethers=true twist_damping_per_s=0 "
       "refine_above_strain=0",
       {8, 14, 20, 30, 60, 120}},
      {"strips + tethers + twist",
       "integration=ONE_STEP direction=AT_END sweep=STRIPS use_tethers=true "
       "twist_damping_per_s=150 refine_above_strain=0",
       {4, 8, 14, 30, 60}},
      {"colours + tethers",
       "integration=ONE_STEP direction=AT_END sweep=COLOURS use_tethers=true twist_damping_per_s=0 "
       "refine_above_strain=0",
       {4, 8, 12, 16, 24, 40, 60, 100, 200}},
      {"colours + tethers + twist",
       "integration=ONE_STEP direction=AT_END sweep=COLOURS use_tethers=true "
       "twist_damping_per_s=150 refine_above_strain=0",
       {16, 40, 100}},
      {"colours",
       "integration=ONE_STEP direction=AT_END sweep=COLOURS use_tethers=false "
       "twist_damping_per_s=0 "
       "refine_above_strain=0",
       {30, 100}},
      {"ACCURATE", "preset=ACCURATE", {2, 4, 8}},
  };
  return families;
}

}  // namespace

std::vector<Method> CurveMethods() {
  std::vector<Method> methods;
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    const std::string name(PresetName(preset));
    methods.push_back({name, name, PresetSettings(preset)});
  }
  for (const Family& family : Families()) {
    const Result<StepSettings> settings = ParseSettings(family.words);
    DRAPE_CHECK(settings.ok(), settings.status().ToString());
    for (const uint32_t substeps : family.substeps) {
      StepSettings exact = *settings;
      exact.substeps = substeps;
      exact.load_limit = 0;  // exactly the requested number
      const std::string name = std::string(family.name) + " " + std::to_string(substeps);
      methods.push_back({family.name, name, exact});
    }
  }
  return methods;
}

}  // namespace drape::bench
