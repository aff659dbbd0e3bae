// Tests over backends and presets, and consequences of a scheme's order.
//
// A preset is its scheme here: the direction of its impulses, how it integrates springs, its
// velocity stage. Step size, sweeps and tolerance are the test's, so that the error seen is that of
// the discretisation and not that of equations left unsolved.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tests/physics/physics_test.h"

namespace drape::test {

inline const std::vector<Preset> kAllPresets = {Preset::kPaper, Preset::kRealtime,
                                                Preset::kAccurate};

// The table of orders in the step, by preset, for rigid links. In one step impulses along the
// direction at the END of the substep are first order, with two steps they are second.
constexpr int SchemeOrder(Preset preset) {
  switch (preset) {
    case Preset::kPaper:
      return 1;
    case Preset::kRealtime:
      return 2;
    case Preset::kAccurate:
      return 2;
  }
  return 0;
}

// A preset's scheme over `duration_s` as one step of `substeps` substeps, all sweeps made.
inline StepSettings SchemeSettings(Preset preset, double duration_s, uint32_t substeps,
                                   uint32_t sweeps) {
  StepSettings settings = PresetSettings(preset);
  settings.time_step_s = duration_s;
  settings.substeps = substeps;
  settings.max_iterations = sweeps;
  settings.tolerance = 0;
  // Numerical damping of its own rate; the order is that of what is left without it.
  settings.twist_damping_per_s = 0;
  return settings;
}

// Parameter: a backend's name and a preset.
class PresetTest : public PhysicsBase,
                   public ::testing::WithParamInterface<std::tuple<std::string, Preset>> {
 protected:
  std::string backend_name() const override { return std::get<0>(GetParam()); }
  Preset preset() const { return std::get<1>(GetParam()); }
  int order() const { return SchemeOrder(preset()); }
};

// Every pair of a backend and a preset is in one tier. Kernels of gl take about a second each to
// compile, and every preset has its own: in the short tier gl has the default preset.
inline std::vector<std::tuple<std::string, Preset>> BackendsAndPresets(bool is_long) {
  std::vector<std::tuple<std::string, Preset>> pairs;
  for (const std::string& backend : BackendNames()) {
    for (const Preset preset : kAllPresets) {
      if ((backend == "gl" && preset != Preset::kRealtime) == is_long) {
        pairs.emplace_back(backend, preset);
      }
    }
  }
  return pairs;
}

inline std::string NameOfPair(
    const ::testing::TestParamInfo<std::tuple<std::string, Preset>>& case_info) {
  return std::get<0>(case_info.param) + "_" + std::string(PresetName(std::get<1>(case_info.param)));
}

#define DRAPE_PRESET_TEST_ON_EVERY_BACKEND(suite)                                       \
  INSTANTIATE_TEST_SUITE_P(BackendsAndPresets, suite,                                   \
                           ::testing::ValuesIn(BackendsAndPresets(false)), NameOfPair); \
  INSTANTIATE_TEST_SUITE_P(BackendsAndPresetsLong, suite,                               \
                           ::testing::ValuesIn(BackendsAndPresets(true)), NameOfPair)

// One quantity at the step sizes h, h/2, h/4. If it is exact + c h^p + O(h^(p+1)), then
// (2^p q(h/2) - q(h)) / (2^p - 1) has lost the term of order p.
struct Refinement {
  std::array<double, 3> values;
  int order;

  double Extrapolated(size_t k) const {
    const double factor = std::exp2(order);
    return (factor * values[k + 1] - values[k]) / (factor - 1);
  }
  double limit() const { return Extrapolated(1); }
  // The two extrapolations differ by (2^(p+1) - 1) times the error of the finer one if the next
  // order leads, at least 3 times: this is what the scheme's order allows `limit` to be off.
  double bound() const { return std::abs(Extrapolated(1) - Extrapolated(0)); }
  // The largest factor with which rounding errors of the values enter `limit` and `bound`.
  double rounding_gain() const { return 4 * (std::exp2(order) + 1) / (std::exp2(order) - 1); }
};

// Scenes must start with velocities that no constraint forbids: removing those takes an impulse at
// the start, whose error may be of a lower order than the scheme's.
//
// Errors at h, h/2 and h/4 shrink by the order, less 0.2 for the higher orders that still count at
// steps this long, and down to rounding.
inline void ExpectOrder(const std::array<double, 3>& errors, int order, double rounding) {
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_LE(errors[k + 1], errors[k] / std::exp2(order - 0.2) + rounding)
        << "halving the step again, from " << errors[k] << ": measured order "
        << std::log2(errors[k] / errors[k + 1]);
  }
}

// `values` extrapolated to step 0 is the exact value as far as the order of the scheme promises.
inline void ExpectLimit(const std::array<double, 3>& values, int order, double exact,
                        double rounding, const std::string& what) {
  const Refinement refinement{values, order};
  EXPECT_NEAR(refinement.limit(), exact, refinement.bound() + refinement.rounding_gain() * rounding)
      << what << " at h, h/2, h/4: " << values[0] << " " << values[1] << " " << values[2];
}

}  // namespace drape::test
