// The scenes of the parity tests and the stability atlas: states and reports have the bits that are
// recorded in tests/golden/states.
#include <gtest/gtest.h>

#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/load.h"
#include "tests/golden/golden_rows.h"
#include "tests/golden/golden_scenes.h"
#include "tests/stability/atlas/atlas.h"
#include "tests/stability/atlas/atlas_scenes.h"
#include "tests/support/backends/backends.h"
#include "tests/support/reports.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

// Cloths of a scene in one batch: enough for lanes, with places left over.
constexpr uint32_t kSideBySide = 6;
constexpr uint32_t kGlBatch = 2;

// Steps `scenes` in one batch, with their `pin_targets_m` if there are any; returns the hash of all
// reports and of the last states.
std::string HashOf(Backend& backend, const std::vector<Scene>& scenes, uint32_t steps,
                   const std::function<std::vector<Eigen::Vector3d>(uint32_t)>& pin_targets_m) {
  std::vector<StepItem> items;
  for (const Scene& scene : scenes) {
    items.push_back({.cloth = CreateCloth(backend, scene),
                     .pin_targets_m = scene.pin_targets_m,
                     .rest_lengths_m = scene.rest_length_targets_m});
  }
  StateHash hash;
  std::vector<Eigen::Vector3d> targets_m;
  for (uint32_t step = 0; step < steps; ++step) {
    if (pin_targets_m) targets_m = pin_targets_m(step);
    for (StepItem& item : items) {
      item.measure = step + 1 == steps;
      if (pin_targets_m) item.pin_targets_m = targets_m;
    }
    for (const StepReport& report : backend.Step(items).reports) hash.Add(ReportBits(report));
  }
  for (const StepItem& item : items) {
    hash.Add(ReadBits(backend, item.cloth));
    backend.Destroy(item.cloth);
  }
  return hash.Text();
}

std::string HashOfCopies(
    Backend& backend, const Scene& scene, uint32_t copies, uint32_t steps,
    const std::function<std::vector<Eigen::Vector3d>(uint32_t)>& targets = {}) {
  std::vector<Scene> scenes;
  for (uint32_t index = 0; index < copies; ++index) scenes.push_back(GoldenCopy(scene, index));
  return HashOf(backend, scenes, steps, targets);
}

struct Width {
  std::string file;     // the rows' file is named after it
  std::string backend;  // as of MakeBackend
  uint32_t copies;
};

void PrintTo(const Width& width, std::ostream* stream) {
  *stream << width.file;
}

const Width kReference{"reference", "reference", 1};
const Width kCpuSingle{"cpu_single", "cpu", 1};
const Width kCpuSideBySide{"cpu_side_by_side", "cpu", kSideBySide};
const Width kGl{"gl", "gl", kGlBatch};

// With more threads, cloths side by side would be shared out among them, and fewer than fill lanes
// are stepped alone.
std::unique_ptr<Backend> BackendOf(const Width& width) {
  if (width.backend != "cpu" || width.copies == 1) return MakeBackend(width.backend);
  return CreateCpuBackend({.thread_count = 1});
}

std::string DeviceOf(const Backend& backend) {
  const BackendDescription description = backend.Describe();
  return GoldenDevice(description.name, description.device);
}

class GoldenStatesTest : public testing::TestWithParam<Width> {};
class GoldenStatesLong : public testing::TestWithParam<Width> {};
INSTANTIATE_TEST_SUITE_P(Widths, GoldenStatesTest,
                         testing::Values(kReference, kCpuSingle, kCpuSideBySide),
                         [](const auto& one) { return one.param.file; });
INSTANTIATE_TEST_SUITE_P(Widths, GoldenStatesLong,
                         testing::Values(kReference, kCpuSingle, kCpuSideBySide),
                         [](const auto& one) { return one.param.file; });

void CheckScenes(const Width& width, const std::vector<Scene>& scenes, const std::string& prefix,
                 uint32_t steps) {
  const std::unique_ptr<Backend> backend = BackendOf(width);
  GoldenRows rows;
  for (const Scene& scene : scenes) {
    const std::string hash = HashOfCopies(*backend, scene, width.copies, steps);
    EXPECT_TRUE(rows.emplace(scene.name, hash).second) << "two scenes " << scene.name;
  }
  ExpectGolden(prefix + width.file, DeviceOf(*backend), rows);
}

TEST_P(GoldenStatesTest, Scenes) {
  CheckScenes(GetParam(), GoldenScenes(), "scenes_", 6);
}
TEST_P(GoldenStatesLong, ScenesGoOn) {
  CheckScenes(GetParam(), GoldenScenes(), "scenes_long_", 30);
}

// llvmpipe compiles for about a second per scene.
TEST(GoldenGlTest, FewScenes) {
  CheckScenes(kGl, FewGoldenScenes(), "few_scenes_", 2);
}

std::string NameOf(const std::string& words) {
  return std::regex_replace(words, std::regex("[^A-Za-z0-9.=+-]+"), "_");
}

void CheckAtlas(const Width& width, AtlasForm form, const std::string& prefix, uint32_t steps) {
  const std::unique_ptr<Backend> backend = BackendOf(width);
  GoldenRows rows;
  const auto add = [&](const std::string& name, const AtlasCase& atlas_case,
                       const AtlasMethod& method) {
    Scene scene = atlas_case.scene;
    scene.parameters.settings = method.settings;
    scene.parameters.settings.time_step_s = atlas_case.time_step_s;
    scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);  // as the server does
    const std::string hash =
        HashOfCopies(*backend, scene, width.copies, steps, atlas_case.pin_targets_m);
    EXPECT_TRUE(rows.emplace(NameOf(name), hash).second) << "two cases " << name;
  };
  for (const AtlasMethod& method : AtlasMethods(form)) {
    for (const AtlasTable& table : AtlasTables(form)) {
      for (const AxisValue& row : table.rows.values) {
        for (const AxisValue& column : table.columns.values) {
          add(method.name + " " + table.name + " " + row.label + " " + column.label,
              table.make(row.value, column.value), method);
        }
      }
    }
    for (const auto& [name, atlas_case] : CaughtCases()) {
      add(method.name + " caught " + name, atlas_case, method);
    }
  }
  ExpectGolden(prefix + width.file, DeviceOf(*backend), rows);
}

TEST_P(GoldenStatesTest, Atlas) {
  CheckAtlas(GetParam(), AtlasForm::kThin, "atlas_", 4);
}
TEST(GoldenGlLong, Atlas) {
  CheckAtlas(kGl, AtlasForm::kThin, "atlas_long_", 4);
}

}  // namespace
}  // namespace drape::test
