#include "tests/bench/kernels/dump.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/core/check.h"
#include "server/solver/gl_compute/kernel_variant.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/strip_lanes.h"
#include "shaders/interface/bindings.h"
#include "tests/bench/kernels/named_cloths.h"

namespace drape::bench {

namespace {

using nlohmann::json;

// Of a GPU as the server sees it.
DeviceTraits HardwareTraits(StripSolve strip_solve) {
  constexpr uint32_t kNoLimit = 1u << 24;
  return {.is_software = false,
          .loop_budget = kNoLimit,
          .strip_solve = strip_solve,
          .shares_record = true};
}

const char* NameOf(StripSolve strip_solve) {
  if (strip_solve == StripSolve::kFromBothEnds) return "both_ends";
  return IsReduction(strip_solve) ? "reduction" : "elimination";
}

uint32_t MostTethers(const SceneModel& model) {
  const auto offsets = model.tether_offsets();
  uint32_t most = 0;
  for (size_t i = 0; i + 1 < offsets.size(); ++i)
    most = std::max(most, offsets[i + 1] - offsets[i]);
  return most;
}

// Of a phase of strips; 0 where they are not solved by lanes.
uint32_t MostLanes(const SceneModel& model) {
  if (model.particle_count() > kMaxResidentParticles || !FitsInLanes(model)) return 0;
  const std::vector<uint32_t> lanes = CountStripLanes(model);
  return lanes.empty() ? 0 : *std::ranges::max_element(lanes);
}

// Numbers that bound the kernels' loops, under the names that the shaders use.
json SizesOf(const PlannedCloth& cloth) {
  const SceneModel& model = cloth.model;
  const StripSet& strips = model.strips();
  const uint32_t phases = std::max(strips.phase_count(), 1u);
  const uint32_t colours = std::max<uint32_t>(model.colour_count(), 1);
  const StepSettings& settings = cloth.parameters.settings;
  return {{"particle_count", model.particle_count()},
          {"pin_count", model.pin_count()},
          {"constraint_count", model.constraint_count()},
          {"colour_count", model.colour_count()},
          {"links_per_colour", (model.constraint_count() + colours - 1) / colours},
          {"strip_phase_count", strips.phase_count()},
          {"strips_per_phase", (strips.strip_count() + phases - 1) / phases},
          {"links_per_strip", LongestStrip(strips)},
          {"lanes_per_phase", MostLanes(model)},
          {"tethers_per_particle", MostTethers(model)},
          {"elastic_count", model.elastic_count()},
          {"elastic_family_count", model.elastic_lines().families.size()},
          {"triangle_count", model.triangles().size()},
          {"collider_count", cloth.parameters.colliders.size()},
          {"substeps", cloth.plan.schedule.size()},
          {"max_iterations", settings.max_iterations},
          {"grid_columns", model.grid_columns()},
          {"grid_rows", model.grid_rows()}};
}

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

struct Program {
  std::string kernel;
  std::string defines;
  uint32_t local_size = 0;
};

std::vector<Program> ProgramsOf(const KernelVariant& variant) {
  if (!variant.is_tiled()) return {{"resident_step", variant.Defines(), variant.local_size}};
  std::vector<Program> programs;
  for (const TiledKernel& kernel : TiledKernels()) {
    if (!variant.traits.HasAnyOf(kernel.needed_by)) continue;
    programs.push_back({kernel.file, DefinesOf(kernel, variant), variant.*kernel.local_size});
  }
  return programs;
}

}  // namespace

void DumpKernels(const KernelsOptions& options) {
  std::filesystem::create_directories(options.dump);
  const Result<gl::ShaderLibrary> library = OpenShaders(options.shader_dir);
  if (!library.ok()) throw std::runtime_error(library.status().ToString());
  json programs = json::array();
  std::set<std::string> texts;
  for (const NamedCloth& named : NamedCloths()) {
    if (!named.is_counted) continue;
    const PlannedCloth cloth = PlanOnDevice(*named.scene.model, named.scene.parameters);
    Result<VariantChoice> choice = ChooseVariant(cloth, HardwareTraits(named.strip_solve));
    DRAPE_CHECK(choice.ok(), choice.status().ToString());
    choice->variant.traits.Add(Feature::kImpulses, named.tells_impulses);
    for (const Program& program : ProgramsOf(choice->variant)) {
      const Result<gl::ShaderSource> source = AssembleKernel(
          library.value(), program.kernel, "#define CORRECTS_ROOTS\n" + program.defines);
      DRAPE_CHECK(source.ok(), source.status().ToString());
      if (!texts.insert(source->text).second) continue;  // shared by two variants
      const std::string name = named.name + "." + program.kernel;
      WriteText(options.dump / (name + ".glsl"), source->text);
      programs.push_back({{"name", name},
                          {"kernel", program.kernel},
                          {"local_size", program.local_size},
                          {"strips", NameOf(choice->variant.strip_solve)},
                          {"sizes", SizesOf(cloth)}});
    }
  }
  WriteText(options.dump / "kernels.json", programs.dump(1) + "\n");
}

}  // namespace drape::bench
