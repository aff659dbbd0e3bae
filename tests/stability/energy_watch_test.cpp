// A step that would give a cloth energy for no reason is done again more dissipatively, and says
// so.
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/random_cloths.h"
#include "tests/support/reports.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class EnergyWatchTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, EnergyWatchTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// A sheet whose pins are 1.6 times as far apart as it is long: its lengths cannot be met.
Scene TornSheet(double speed_m_per_s, uint32_t columns = 8, uint32_t rows = 8,
                const StructuralMaterial& material = {}) {
  const uint32_t corner = columns - 1;
  Scene scene = Grid(columns, rows, 1, 1, {0, corner}, material);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.state.positions_m[0].x() -= 0.3;
  scene.state.positions_m[corner].x() += 0.3;
  scene.pin_targets_m = {scene.state.positions_m[0], scene.state.positions_m[corner]};
  Stir(scene, speed_m_per_s);
  return scene;
}

// Some of the steps warn, and none faults.
void ExpectWarnings(Backend& backend, const Scene& scene, int steps) {
  const ClothHandle cloth = CreateCloth(backend, scene);
  uint32_t warned = 0;
  for (int step = 0; step < steps; ++step) {
    const StepReport report = StepAlone(backend, cloth, scene);
    ASSERT_EQ(report.fault, FaultReason::kNone) << "step " << step;
    warned += report.warnings.energy_gained;
  }
  EXPECT_GT(warned, 0u);
  backend.Destroy(cloth);
}

TEST_P(EnergyWatchTest, WarnsOfASheetThatIsTornApart) {
  ExpectWarnings(SharedBackend(GetParam()), TornSheet(0.1), 120);
}

// The same sheet in so many particles that the tiled plan of gl has it.
TEST_P(EnergyWatchTest, WarnsOfALargeSheetThatIsTornApart) {
  ExpectWarnings(SharedBackend(GetParam()), TornSheet(0, 34, 32), 8);
}

// What is not finite is done again too, also where pins move, and faults only then: the last good
// state stays.
TEST_P(EnergyWatchTest, TriesAgainBeforeItFaults) {
  Backend& backend = SharedBackend(GetParam());
  for (const uint32_t rows : {8u, 32u}) {  // resident and tiled
    Scene scene = TornSheet(0.1, 34, rows);
    const ClothHandle cloth = CreateCloth(backend, scene);
    const std::string start = ReadBits(backend, cloth);
    scene.pin_targets_m[0].x() = std::numeric_limits<double>::infinity();
    const StepReport report = StepAlone(backend, cloth, scene);
    EXPECT_EQ(report.fault, FaultReason::kNotFinite) << rows << " rows";
    EXPECT_TRUE(report.warnings.energy_gained) << rows << " rows: it was not tried again";
    EXPECT_EQ(ReadBits(backend, cloth), start) << rows << " rows";
    backend.Destroy(cloth);
  }
}

// Pins that move do work, and so may everything that is not watched.
TEST_P(EnergyWatchTest, IsSilentWhereEnergyMayComeFrom) {
  Backend& backend = SharedBackend(GetParam());
  for (const char* what : {"pins", "wind"}) {
    Scene scene = TornSheet(0.1);
    if (*what == 'w') {
      scene.parameters.air_drag = 1;
      scene.parameters.wind_m_per_s = Vector3d(0, 0, 1);
    }
    const ClothHandle cloth = CreateCloth(backend, scene);
    for (int step = 0; step < 60; ++step) {
      if (*what == 'p') scene.pin_targets_m[0].y() += 1e-4;
      EXPECT_FALSE(StepAlone(backend, cloth, scene).warnings.energy_gained) << what << " " << step;
    }
    backend.Destroy(cloth);
  }
}

// Links that give way count with their energy: they may give back what they hold, and no more.
TEST_P(EnergyWatchTest, WarnsOfStiffLinksThatAreTornApart) {
  const Scene scene = TornSheet(0.1, 8, 8, {.stretch_compliance_m_per_n = 1e-6});
  ExpectWarnings(SharedBackend(GetParam()), scene, 60);
}

// A sheet that is let go stretched turns its elastic energy into motion, many times m g l.
TEST_P(EnergyWatchTest, IsSilentForSheetsThatGiveBackWhatTheyHold) {
  Backend& backend = SharedBackend(GetParam());
  for (const double compliance_m_per_n : {1e-2, 1e-3, 5e-4}) {
    for (const bool is_mesh : {false, true}) {
      const StructuralMaterial material{.stretch_compliance_m_per_n = compliance_m_per_n};
      Scene scene = is_mesh ? MeshedGrid(10, 10, 1, 1, {0, 9}, material)
                            : Grid(10, 10, 1, 1, {0, 9}, material);
      scene.parameters.settings = PresetSettings(Preset::kRealtime);
      for (size_t i = 0; i < scene.state.positions_m.size(); ++i) {
        if (i != 0 && i != 9) scene.state.positions_m[i].z() *= 1.3;
      }
      const ClothHandle cloth = CreateCloth(backend, scene);
      for (int step = 0; step < 60; ++step) {
        EXPECT_FALSE(StepAlone(backend, cloth, scene).warnings.energy_gained)
            << compliance_m_per_n << " m/N, " << (is_mesh ? "mesh" : "grid") << ", step " << step;
      }
      backend.Destroy(cloth);
    }
  }
}

// Few sweeps stretch a mesh of stiff edges, which stores energy that never becomes motion.
TEST_P(EnergyWatchTest, WarnsOfMeshesThatFewSweepsStretch) {
  for (const double rigidity_n_m : {0.0, 1e-4}) {
    Scene scene =
        MeshedGrid(20, 17, 0.6, 0.5, {0},
                   {.stretch_stiffness_n_per_m = 20000, .bending_rigidity_n_m = rigidity_n_m});
    scene.parameters.settings = PresetSettings(Preset::kPaper);
    ExpectWarnings(SharedBackend(GetParam()), scene, 40);
  }
}

// What bending and shear store is given back, and no more.
TEST_P(EnergyWatchTest, IsSilentForFabrics) {
  Backend& backend = SharedBackend(GetParam());
  for (const double moduli : {1.0, 1e3}) {
    for (const bool is_mesh : {false, true}) {
      const StructuralMaterial material{.stretch_stiffness_n_per_m = is_mesh ? 2000.0 : 0.0,
                                        .bending_rigidity_n_m = 1e-5 * moduli,
                                        .shear_modulus_n_per_m = 10 * moduli};
      Scene scene = is_mesh ? MeshedGrid(12, 10, 0.5, 0.4, {0}, material)
                            : Grid(12, 10, 0.5, 0.4, {0}, material);
      scene.parameters.settings = PresetSettings(Preset::kRealtime);
      Stir(scene, 2);
      const ClothHandle cloth = CreateCloth(backend, scene);
      for (int step = 0; step < 60; ++step) {
        EXPECT_FALSE(StepAlone(backend, cloth, scene).warnings.energy_gained)
            << moduli << ", " << (is_mesh ? "mesh" : "grid") << ", step " << step;
      }
      backend.Destroy(cloth);
    }
  }
}

// An ordinary sheet never has the warning, nor a step that is done twice.
TEST_P(EnergyWatchTest, IsSilentForOrdinarySheets) {
  Backend& backend = SharedBackend(GetParam());
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    Scene scene = Grid(12, 12, 1, 1, {0, 11});
    scene.parameters.settings = PresetSettings(preset);
    const ClothHandle cloth = CreateCloth(backend, scene);
    for (int step = 0; step < 120; ++step) {
      EXPECT_FALSE(StepAlone(backend, cloth, scene).warnings.energy_gained)
          << PresetName(preset) << " step " << step;
    }
    backend.Destroy(cloth);
  }
}

// Steps the cloths together and each alone, and expects equal bits and reports. Returns how many
// steps warned.
uint32_t ExpectSameTogetherAsAlone(Backend& backend, const std::vector<Scene>& scenes, int steps,
                                   std::optional<EnergyBalance> energy = {}) {
  std::vector<ClothHandle> together, alone;
  std::vector<StepItem> items;
  for (const Scene& scene : scenes) {
    together.push_back(CreateCloth(backend, scene));
    alone.push_back(CreateCloth(backend, scene));
    items.push_back({.cloth = together.back(), .pin_targets_m = {}, .measure = true});
    items.back().energy = energy;
  }
  uint32_t warned = 0;
  for (int step = 0; step < steps; ++step) {
    const BatchReport batch = backend.Step(items);
    for (size_t k = 0; k < scenes.size(); ++k) {
      StepItem item = items[k];
      item.cloth = alone[k];
      const StepReport report = backend.Step({&item, 1}).reports[0];
      EXPECT_EQ(DifferenceOf(batch.reports[k], report), "") << "step " << step << " cloth " << k;
      EXPECT_EQ(ReadBits(backend, together[k]), ReadBits(backend, alone[k]))
          << "step " << step << " cloth " << k;
      warned += report.warnings.energy_gained;
    }
    if (testing::Test::HasFailure()) break;
  }
  for (size_t k = 0; k < scenes.size(); ++k) {
    backend.Destroy(together[k]);
    backend.Destroy(alone[k]);
  }
  return warned;
}

// The decision is the cloth's own, whatever the others in its lanes do.
TEST(EnergyWatchInLanes, StepsAgainAsAlone) {
  std::vector<Scene> scenes;
  for (int k = 0; k < 16; ++k) scenes.push_back(TornSheet(0.1 * k));
  for (Scene& scene : std::span(scenes).last(4)) {  // whole
    scene.state = RestState(*scene.model);
    scene.pin_targets_m.clear();
  }
  const uint32_t warned = ExpectSameTogetherAsAlone(SharedBackend("cpu"), scenes, 40);
  EXPECT_GT(warned, 0u) << "nothing was done again";
  EXPECT_LT(warned, 40 * scenes.size());
}

// Strips with ways back.
TEST(EnergyWatchInLanes, LinkagesAndUnequalMassesAsAlone) {
  for (const RandomKind kind :
       {RandomKind::kLinkage, RandomKind::kChain, RandomKind::kTree, RandomKind::kSheet}) {
    Scene scene = RandomCloth(kind, 12);
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    ASSERT_GT(scene.model->strips().phase_count(), scene.model->strips().phase_count_there)
        << scene.name;
    std::vector<Scene> scenes;
    for (int k = 0; k < 5; ++k) {
      Stir(scene, 0.1 * k);
      scenes.push_back(scene);
    }
    ExpectSameTogetherAsAlone(SharedBackend("cpu"), scenes, 20);
    // None may gain anything any more.
    ExpectSameTogetherAsAlone(SharedBackend("cpu"), scenes, 20, EnergyBalance{1e6, 1e-6});
    // Without a calmer scheme velocities lose it at once.
    for (Scene& one : scenes) one.parameters.settings = PresetSettings(Preset::kPaper);
    ExpectSameTogetherAsAlone(SharedBackend("cpu"), scenes, 20, EnergyBalance{1e6, 1e-6});
    EXPECT_FALSE(HasFailure()) << scene.name;
  }
}

}  // namespace
}  // namespace drape::test
