// Chains and cloths that swing, against the exact planar chain (tests/support/planar_chain.h) and,
// where there is no exact motion, against themselves at smaller steps.
#include <algorithm>
#include <numeric>

#include "tests/physics/chain_scene.h"
#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

double LargestDistance(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  return FindWorst(a, b).distance;
}

class ChainMotion : public PresetTest {
 protected:
  // Each substep rounds a position of at most 1 m twice, and 4 times a velocity whose error acts
  // for the rest of a motion over which a particle travels about the length of the chain.
  double Rounding(uint32_t substeps) { return 6.0 * substeps * round_off(); }

  void ExpectTheExactMotion(const PlanarChain& start, double duration_s, uint32_t substeps,
                            uint32_t sweeps) {
    PlanarChain exact = start;
    exact.AdvanceConverged(duration_s, 1e-11);
    std::array<double, 3> errors{};
    for (size_t k = 0; k < 3; ++k, substeps *= 2) {
      Scene scene = SceneOf(start);
      scene.parameters.settings = SchemeSettings(preset(), duration_s, substeps, sweeps);
      errors[k] = LargestDistance(StateAfter(scene).positions_m, exact.Positions_m());
    }
    ExpectOrder(errors, order(), Rounding(substeps / 2));
  }

  // A cloth hung by its whole top row is as many chains side by side, and the constraints across
  // are never needed. Let go in a plane at 1 rad, so that the whip of a horizontal start, which no
  // step of this size resolves, is not all that is measured.
  void ExpectASheafOfChains(uint32_t columns) {
    constexpr uint32_t kRows = 5;
    constexpr double kDuration_s = 0.4, kAngle_rad = 1, kCell_m = 0.1;
    PlanarChain exact = StraightChain(kRows - 1, kCell_m, 1, kAngle_rad);
    exact.AdvanceConverged(kDuration_s, 1e-11);
    const std::vector<Vector3d> column = exact.Positions_m();
    std::vector<uint32_t> pins(columns);
    std::iota(pins.begin(), pins.end(), 0);
    std::array<double, 3> errors{};
    for (size_t k = 0; k < 3; ++k) {
      Scene scene = Grid(columns, kRows, kCell_m * (columns - 1), kCell_m * (kRows - 1), pins);
      std::vector<Vector3d> expected;
      for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
        Vector3d& p = scene.state.positions_m[i];
        expected.emplace_back(p.x(), column[i / columns].y(), column[i / columns].x());
        p = {p.x(), -p.z() * std::cos(kAngle_rad), p.z() * std::sin(kAngle_rad)};
      }
      scene.parameters.settings = SchemeSettings(preset(), kDuration_s, 60u << k, 40);
      errors[k] = LargestDistance(StateAfter(scene).positions_m, expected);
    }
    // x is up to the width, but nothing moves along it.
    ExpectOrder(errors, order(), Rounding(4 * 60));
  }
};

class ChainMotionLong : public ChainMotion {};

// Unequal links and masses, spinning against each other: within 0.5 s the lower one swings over the
// top. A longer motion is chaotic.
TEST_P(ChainMotion, ADoublePendulumFollowsItsEquations) {
  const PlanarChain start({{.length_m = 0.5, .mass_kg = 0.3, .angle_rad = 1.5, .rate_rad_s = 0},
                           {.length_m = 0.3, .mass_kg = 0.2, .angle_rad = 0.5, .rate_rad_s = 6}});
  ExpectTheExactMotion(start, 0.5, 120, 30);
}

TEST_P(ChainMotion, AChainOfFiveLinksFollowsItsEquations) {
  ExpectTheExactMotion(StraightChain(5, 0.2, 0.1, 1.2), 0.5, 120, 60);
}

TEST_P(ChainMotion, AClothHungByAnEdgeIsASheafOfChains) {
  ExpectASheafOfChains(3);
}

// The same over many work groups: the tiled plan of GL.
TEST_P(ChainMotionLong, AWideClothHungByAnEdgeIsASheafOfChains) {
  ExpectASheafOfChains(206);
}

// The same cloth released horizontally with a smooth, lopsided velocity: no longer in a plane, all
// constraints at work. The change by halving the step shrinks as the error does.
TEST_P(ChainMotion, ASwingingClothConvergesInTheOrderOfItsScheme) {
  std::vector<std::vector<Vector3d>> positions;
  for (uint32_t k = 0; k < 4; ++k) {
    Scene scene = Grid(4, 4, 0.3, 0.3, {0, 1, 2, 3});
    // Across the sheet only, so that no constraint is asked to stretch at the start.
    Stir(scene, 0.5);
    for (Vector3d& v : scene.state.velocities_m_per_s) v = {0, v.y(), 0};
    scene.parameters.settings = SchemeSettings(preset(), 0.2, 30u << k, 60);
    positions.push_back(StateAfter(scene).positions_m);
  }
  std::array<double, 3> changes{};
  for (size_t k = 0; k < 3; ++k) changes[k] = LargestDistance(positions[k], positions[k + 1]);
  ExpectOrder(changes, order(), 2 * Rounding(240));
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(ChainMotion);
DRAPE_PRESET_TEST_ON_EVERY_BACKEND(ChainMotionLong);

}  // namespace
}  // namespace drape::test
