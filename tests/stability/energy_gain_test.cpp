// No random linkage, chain, tree, net or sheet gains energy, whatever its masses, with any preset.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "server/solver/load.h"
#include "tests/support/backends/backends.h"
#include "tests/support/random_cloths.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

// Of its scale (EnergyScale_j), at any time.
constexpr double kMaxGain = 0.01;

// A random cloth with a preset, as the server steps it.
struct Trial {
  Scene scene;
  ClothHandle cloth;
  double start_j = 0;
  double largest_gain = 0;  // of its scale
  bool has_fault = false;
};

Trial Begin(Backend& backend, RandomKind kind, uint64_t seed, Preset preset) {
  Scene scene = RandomCloth(kind, seed);
  scene.parameters.settings = PresetSettings(preset);
  scene.parameters.settings.sleep_motion_m = 0;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
  const ClothHandle cloth = CreateCloth(backend, scene);
  const double start_j = Energy_j(scene, ReadState(backend, cloth), 0);
  return {.scene = std::move(scene), .cloth = cloth, .start_j = start_j};
}

void Judge(Backend& backend, const StepReport& report, Trial& trial) {
  trial.has_fault |= report.fault != FaultReason::kNone;
  const double lag_m_per_s = trial.scene.parameters.gravity_m_per_s2.norm() *
                             trial.scene.parameters.settings.substep_s() / 2;
  const double energy_j = Energy_j(trial.scene, ReadState(backend, trial.cloth), lag_m_per_s);
  trial.largest_gain =
      std::max(trial.largest_gain, (energy_j - trial.start_j) / EnergyScale_j(trial.scene));
}

// Steps the cloths of these seeds together for that long, and expects that none gains.
void ExpectNoGain(const std::string& backend_name, RandomKind kind, Preset preset,
                  uint64_t first_seed, uint64_t count, double duration_s) {
  Backend& backend = SharedBackend(backend_name);
  std::vector<Trial> trials;
  for (uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
    trials.push_back(Begin(backend, kind, seed, preset));
  }
  std::vector<StepItem> items;
  for (const Trial& trial : trials) items.push_back({trial.cloth, {}, false});
  const double step_s = trials.at(0).scene.parameters.settings.time_step_s;
  for (double time_s = 0; time_s < duration_s; time_s += step_s) {
    const BatchReport batch = backend.Step(items);
    for (size_t k = 0; k < trials.size(); ++k) Judge(backend, batch.reports[k], trials[k]);
  }
  for (const Trial& trial : trials) {
    EXPECT_FALSE(trial.has_fault) << trial.scene.name;
    EXPECT_LE(trial.largest_gain, kMaxGain) << trial.scene.name;
    backend.Destroy(trial.cloth);
  }
}

using Case = std::tuple<std::string, Preset, RandomKind>;

std::string NameOf(const testing::TestParamInfo<Case>& info) {
  const auto& [backend, preset, kind] = info.param;
  return backend + "_" + std::string(PresetName(preset)) + "_" +
         std::string(kRandomKindNames.at(static_cast<size_t>(kind)));
}

constexpr std::array kKinds = {RandomKind::kLinkage, RandomKind::kFrame, RandomKind::kChain,
                               RandomKind::kTree,    RandomKind::kNet,   RandomKind::kSheet,
                               RandomKind::kMesh};

class EnergyGainTest : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Presets, EnergyGainTest,
                         testing::Combine(testing::Values("cpu"),
                                          testing::Values(Preset::kRealtime, Preset::kPaper),
                                          testing::ValuesIn(kKinds)),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(
    Reference, EnergyGainTest,
    testing::Combine(testing::Values("reference"), testing::Values(Preset::kRealtime),
                     testing::Values(RandomKind::kLinkage, RandomKind::kChain)),
    NameOf);

// Four cloths of a kind, some of them those that gained most when the rules knew kinds of scenes
// only.
TEST_P(EnergyGainTest, RandomClothsNeverGain) {
  const auto& [backend, preset, kind] = GetParam();
  ExpectNoGain(backend, kind, preset, 1, 4, 3);
}

class EnergyGainLong : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Presets, EnergyGainLong,
                         testing::Combine(testing::Values("cpu", "reference"),
                                          testing::Values(Preset::kRealtime, Preset::kPaper,
                                                          Preset::kAccurate),
                                          testing::ValuesIn(kKinds)),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(Gl, EnergyGainLong,
                         testing::Combine(testing::Values("gl"), testing::Values(Preset::kRealtime),
                                          testing::Values(RandomKind::kLinkage,
                                                          RandomKind::kChain)),
                         NameOf);

// 301 cloths over the kinds.
TEST_P(EnergyGainLong, ThreeHundredRandomClothsNeverGain) {
  const auto& [backend, preset, kind] = GetParam();
  ExpectNoGain(backend, kind, preset, 1, 43, 5);
}

}  // namespace
}  // namespace drape::test
