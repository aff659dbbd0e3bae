#include "server/solver/load.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/solver/solver_constants.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

TEST(RaiseSubsteps, KeepsTheLoadWithinItsLimit) {
  const test::Scene light = test::Grid(32, 32, 1, 1, {0, 31});
  ClothParameters parameters = light.parameters;
  parameters.settings = PresetSettings(Preset::kRealtime);
  EXPECT_EQ(RaiseSubsteps(*light.model, parameters).settings, parameters.settings);
  // Gamma = h^2 W / n_pins / (m l), of a sheet whose particles all weigh the same.
  const double h = 1.0 / 60 / 52;
  const auto gamma = [&](double gravity) { return h * h * gravity * 1022 / 2 * 31; };
  EXPECT_NEAR(LoadRatio(*light.model, parameters), gamma(9.81), 1e-9);

  parameters.gravity_m_per_s2 *= 15;
  const ClothParameters raised = RaiseSubsteps(*light.model, parameters);
  EXPECT_EQ(raised.settings.substeps, std::ceil(52 * std::sqrt(gamma(15 * 9.81) / 0.15)));
  EXPECT_LE(LoadRatio(*light.model, raised), 0.15);
  parameters.gravity_m_per_s2 *= 1000;
  EXPECT_EQ(RaiseSubsteps(*light.model, parameters).settings.substeps,
            std::ceil(52 * kMaxLoadFactor));
}

TEST(RaiseSubsteps, LeavesAloneWhatIsAskedForOrNotHeld) {
  ClothParameters heavy;
  heavy.gravity_m_per_s2 *= 1000;
  heavy.settings =
      *ResolveSettings(StepSettingsOverrides().Set(&StepSettings::substeps, 52), "settings");
  const test::Scene hung = test::Grid(32, 32, 1, 1, {0, 31});
  EXPECT_EQ(heavy.settings.load_limit, 0);
  EXPECT_EQ(RaiseSubsteps(*hung.model, heavy).settings.substeps, 52u);
  heavy.settings = PresetSettings(Preset::kRealtime);
  const test::Scene free = test::Grid(32, 32, 1, 1);
  EXPECT_EQ(RaiseSubsteps(*free.model, heavy).settings.substeps, 52u);
  // No substep gets shorter than the shortest that is legal.
  heavy.settings.time_step_s = 60e-6;
  EXPECT_GE(RaiseSubsteps(*hung.model, heavy).settings.substep_s(), kMinSubstep_s);
}

}  // namespace
}  // namespace drape
