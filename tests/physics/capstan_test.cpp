// Chains that loads pull over bars hold and slip by Coulomb's law, corner by corner.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "tests/physics/preset_test.h"
#include "tests/support/capstan.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using Bar = CapstanBar;

class Capstan : public PhysicsTest {
 protected:
  // Links heavy enough for the sweeps: they move a particle in contact by its own mass.
  static Bar Chain(double link_kg = 0.05) { return {.hanging = 2, .link_kg = link_kg}; }

  // How far the heavy load sinks in half a second.
  double Sinking(double share) {
    StepSettings settings = SingleSubstep(1.0 / 60, 300);
    settings.substeps = 10;
    settings.sweep = Sweep::kStrips;
    const Scene scene = Chain().Loaded(share, settings);
    const double start = scene.state.positions_m.back().y();
    return start - StateAfter(scene, 30).positions_m.back().y();
  }
};

TEST_P(Capstan, WithoutWeightTheLoadsAreThatOfTheCorners) {
  const Bar bar = Chain(0);
  const double c = std::cos(bar.corner() / 2);
  const double s = bar.friction_static * std::sin(bar.corner() / 2);
  EXPECT_NEAR(bar.SlipLoad_kg(), bar.light_kg * std::pow((c + s) / (c - s), bar.turns), 1e-12);
}

// The requirement: within 3 %.
TEST_P(Capstan, SlipsAtTheLoadRatioOfItsCorners) {
  const double held_m = Sinking(0.97), slipping_m = Sinking(1.03);
  std::printf(
      "[ MEASURED ] capstan on %s: the heavy end sinks %.3g mm in 0.5 s 3 %% below the load "
      "that slips, %.3g mm above\n",
      backend_name().c_str(), 1e3 * held_m, 1e3 * slipping_m);
  EXPECT_LE(std::abs(held_m), 1e-4);
  EXPECT_GE(slipping_m, Chain().Acceleration(1.03) * 0.25 / 2 / 2);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Capstan);

std::vector<Bar> RandomBars(uint32_t seed, uint32_t count) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Bar> bars;
  for (uint32_t k = 0; k < count; ++k) {
    Bar bar;
    bar.turns = static_cast<uint32_t>(std::lround(std::exp(between(std::log(8), std::log(30)))));
    bar.radius_m = between(0.05, 0.3);
    bar.direction = between(0, 2 * std::numbers::pi);
    bar.place_m = Vector3d(between(-0.5, 0.5), between(-0.5, 0.5), between(-0.5, 0.5));
    bar.link_kg = between(0.02, 0.1);
    bar.friction_static = between(0.2, 0.45);
    bar.dynamic = between(0.5, 0.9);
    bar.time_step_s = k % 3 == 2 ? 1.0 / 30 : 1.0 / 60;
    bars.push_back(bar);
  }
  return bars;
}

// Presets with two steps. With a dynamic coefficient below the static one what slips first would
// hold less, and hand on its load.
class LoadedChain : public PresetTest {
 protected:
  // What is let go runs by decimetres; what is held sinks while the load arrives, link by link, and
  // ACCURATE creeps by up to 7 mm in single precision.
  static constexpr double kHeld_m = 0.01;

  std::string Measured(double share, const std::string& what) {
    return "[ MEASURED ] " + std::string(PresetName(preset())) + " on " + backend_name() + ", " +
           std::to_string(std::lround(100 * share)) + " % of the limit, " + what;
  }

  // How far the heavy load sinks in a second.
  double Sinking(const Bar& bar, double share) {
    const Scene scene = bar.Loaded(share, PresetSettings(preset()));
    const auto steps = static_cast<uint32_t>(std::lround(1 / bar.time_step_s));
    return scene.state.positions_m.back().y() - StateAfter(scene, steps).positions_m.back().y();
  }

  // How fast it sinks in the half second after that, if the coefficients are equal, in order [m/s].
  std::vector<double> Creep_m_per_s(const std::vector<Bar>& bars, double share) {
    std::vector<double> speeds;
    for (Bar bar : bars) {
      bar.dynamic = 1;
      const Scene scene = bar.Loaded(share, PresetSettings(preset()));
      const auto steps = static_cast<uint32_t>(std::lround(1 / bar.time_step_s));
      const double settled_m = StateAfter(scene, steps).positions_m.back().y();
      const double later_m = StateAfter(scene, steps + steps / 2).positions_m.back().y();
      speeds.push_back((settled_m - later_m) / 0.5);
    }
    std::ranges::sort(speeds);
    return speeds;
  }

  // Prints them.
  void Report(const std::vector<double>& creep_m_per_s, double share) {
    std::printf("%s: %.3f, %.3f, %.3f mm/s\n",
                Measured(share, "one coefficient, least, median and largest creep").c_str(),
                1e3 * creep_m_per_s.front(), 1e3 * creep_m_per_s[creep_m_per_s.size() / 2],
                1e3 * creep_m_per_s.back());
  }

  void ExpectHeld(const Bar& bar) {
    SCOPED_TRACE("turns " + std::to_string(bar.turns) + ", links of " +
                 std::to_string(bar.link_kg) + " kg, friction " +
                 std::to_string(bar.friction_static) + " and " + std::to_string(bar.dynamic));
    EXPECT_LE(Sinking(bar, 0.9), kHeld_m);
    // Well above the limit it runs, no slower than with the static friction.
    EXPECT_GE(Sinking(bar, 1.3), bar.Acceleration(1.3) / 2 / 2);
  }
};

TEST_P(LoadedChain, HoldsWhatItsStaticFrictionCan) {
  // The others in LoadedChainLong.
  const bool is_slow = preset() == Preset::kAccurate && backend_name() == "reference";
  for (const Bar& bar : RandomBars(7, is_slow ? 4 : 8)) ExpectHeld(bar);
}

// 2 % below the limit of one coefficient: in REALTIME 0.2 mm/s at most in double precision, and so
// in single precision, but for few chains whose links the load stretches by no more than some
// roundings of their ends. ACCURATE creeps by more, since its sweeps end at a tolerance
// (presets.md).
TEST_P(LoadedChain, HardlyCreepsNearItsLimit) {
  const bool is_bounded = preset() == Preset::kRealtime;
  const std::vector<double> creep_m_per_s = Creep_m_per_s(RandomBars(9, is_bounded ? 12 : 3), 0.98);
  Report(creep_m_per_s, 0.98);
  if (is_bounded) {
    const auto fast = std::ranges::count_if(creep_m_per_s, [](double v) { return v > 3e-4; });
    EXPECT_LE(fast, backend_name() == "reference" ? 0 : 2);
  }
}

class LoadedChainLong : public LoadedChain {};

// Nearer to the limit rounding may let go in single precision, and farther from the origin: told,
// and not bounded.
TEST_P(LoadedChainLong, ManyHold) {
  for (const Bar& bar : RandomBars(7, 8)) ExpectHeld(bar);
  std::vector<Bar> bars = RandomBars(8, 24);
  for (const Bar& bar : bars) ExpectHeld(bar);
  for (const double share : {0.95, 0.98}) {
    std::vector<double> sunk_m;
    for (const Bar& bar : bars) sunk_m.push_back(Sinking(bar, share));
    std::ranges::sort(sunk_m);
    const auto run = std::ranges::count_if(sunk_m, [](double m) { return m > kHeld_m; });
    std::printf("%s: %td of %zu ran, median %.2f mm\n", Measured(share, "two coefficients").c_str(),
                run, sunk_m.size(), 1e3 * sunk_m[sunk_m.size() / 2]);
  }
  Report(Creep_m_per_s(bars, 0.98), 0.98);
  for (Bar& bar : bars) bar.place_m += Vector3d(5, 0, 3.5);
  std::printf("6 m from the origin: ");
  Report(Creep_m_per_s(bars, 0.98), 0.98);
}

// With one step what slips has the dynamic friction at once (method.md, (42a)).
std::vector<std::tuple<std::string, Preset>> WithTwoSteps(bool is_long) {
  std::vector<std::tuple<std::string, Preset>> pairs = BackendsAndPresets(is_long);
  std::erase_if(pairs, [](const auto& pair) { return std::get<1>(pair) == Preset::kPaper; });
  return pairs;
}

INSTANTIATE_TEST_SUITE_P(BackendsAndPresets, LoadedChain, ::testing::ValuesIn(WithTwoSteps(false)),
                         NameOfPair);
INSTANTIATE_TEST_SUITE_P(BackendsAndPresetsLong, LoadedChain,
                         ::testing::ValuesIn(WithTwoSteps(true)), NameOfPair);
INSTANTIATE_TEST_SUITE_P(BackendsAndPresets, LoadedChainLong,
                         ::testing::ValuesIn(WithTwoSteps(false)), NameOfPair);
INSTANTIATE_TEST_SUITE_P(BackendsAndPresetsLong, LoadedChainLong,
                         ::testing::ValuesIn(WithTwoSteps(true)), NameOfPair);

}  // namespace
}  // namespace drape::test
