// No random linkage, chain, tree, net or sheet gains energy, whatever its masses, with any preset.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <tuple>

#include "tests/stability/atlas/random_trial.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

// Steps the cloths of these seeds together for that long, and expects that none gains.
void ExpectNoGain(const std::string& backend_name, RandomKind kind, Preset preset,
                  uint64_t first_seed, uint64_t count, double duration_s) {
  Backend& backend = SharedBackend(backend_name);
  const StepSettings settings = PresetSettings(preset);
  for (const RandomTrial& trial :
       TryRandomCloths(backend, kind, settings, first_seed, count, duration_s)) {
    EXPECT_EQ(trial.fault, FaultReason::kNone) << trial.name;
    EXPECT_TRUE(trial.is_finite) << trial.name;
    EXPECT_LE(trial.largest_gain, kMaxRandomGain) << trial.name;
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

// 301 cloths over the kinds; on gl, where each has kernels of its own to compile, a few.
TEST_P(EnergyGainLong, ThreeHundredRandomClothsNeverGain) {
  const auto& [backend, preset, kind] = GetParam();
  ExpectNoGain(backend, kind, preset, 1, backend == "gl" ? 3 : 43, 5);
}

}  // namespace
}  // namespace drape::test
