// Stage `solve_strips` alone, every backend in single precision against the reference; in gl by
// elimination and by cyclic reduction. Bounds: round_off.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/solver/load.h"
#include "tests/parity/loose_particles.h"
#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class StripParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, StripParityTest, testing::ValuesIn(StripBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Chains, nets and grids, hanging by pins and free.
TEST_P(StripParityTest, AwkwardSizes) {
  for (const uint32_t particle_count : {2u, 3u, 31u, 33u, 1025u}) {
    for (const bool has_pins : {false, true}) {
      Scene scene = SizedCloth(particle_count, has_pins);
      Stir(scene, 1);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings.sweep = Sweep::kStrips;
      SetSubsteps(scene, 1);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

TEST_P(StripParityTest, UnequalMassesAndCompliance) {
  for (const uint32_t side : {7u, 24u}) {  // the larger one by lanes of four particles
    for (const double compliance_m_per_n : {0.0, 1e-5, 1e-4, 1e-2}) {
      Scene scene = Net(side, 0.2, compliance_m_per_n);
      Stir(scene, 2);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings.sweep = Sweep::kStrips;
      SetSubsteps(scene, 1, 3);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

// A chain stretched to three times its length: the motion of one sweep is limited by one factor for
// the whole strip.
TEST_P(StripParityTest, AnOverstretchedChainInLimitedSteps) {
  Scene scene = Chain(20, 0.1, 0.01);
  for (Vector3d& p : scene.state.positions_m) p *= 3;
  scene.parameters.gravity_m_per_s2.setZero();
  SetSubsteps(scene, 1);
  ExpectParity(GetParam(), scene, 1);
  SetSubsteps(scene, 1, 20);
  ExpectParity(GetParam(), scene, 1);
}

// The sum of limited impulses equals the impulse that acted.
TEST_P(StripParityTest, AnOverstretchedChainThatGivesWay) {
  ParticleTopology particles;
  for (uint32_t i = 0; i <= 20; ++i) {
    particles.positions_m.emplace_back(0.1 * i, 0, 0);
    particles.masses_kg.push_back(0.01);
    if (i > 0) particles.distance_constraints.push_back({i - 1, i, 0.1, 1e-4});
  }
  Scene scene = Particles(particles, {0});
  for (Vector3d& p : scene.state.positions_m) p *= 3;
  scene.parameters.gravity_m_per_s2.setZero();
  SetSubsteps(scene, 1, 3);
  ExpectParity(GetParam(), scene, 1);
}

// Side by side chains of 20 uneven links, of which one particle is pulled out of its row.
Scene UnevenChains(uint32_t chain_count, uint32_t pulled) {
  ParticleTopology particles;
  for (uint32_t chain = 0; chain < chain_count; ++chain) {
    double x_m = 0;
    for (uint32_t k = 0; k <= 20; ++k) {
      const double length_m = k % 3 == 0 ? 0.02 : 0.1;
      const auto i = static_cast<uint32_t>(particles.positions_m.size());
      if (k > 0) {
        particles.distance_constraints.push_back({i - 1, i, length_m, 0});
        x_m += length_m;
      }
      particles.positions_m.emplace_back(x_m, 0, chain);
      particles.masses_kg.push_back(k == pulled ? 0.01 : 0.1);
    }
  }
  Scene scene = Particles(particles);
  scene.name += "_" + std::to_string(chain_count) + "_pulled_at_" + std::to_string(pulled);
  for (uint32_t i = pulled; i < particles.positions_m.size(); i += 21) {
    scene.state.positions_m[i] += Vector3d(0.01, 0.6, 0.02);
  }
  scene.parameters.gravity_m_per_s2.setZero();
  return scene;
}

// The limit of a particle's move is by the length of the link before it; here it is the one that
// was pulled out of its row. Of many chains lanes have four particles.
TEST_P(StripParityTest, LimitedStepsOfUnevenLinks) {
  for (const uint32_t chain_count : {1u, 26u}) {
    for (const uint32_t pulled : {0u, 1u, 9u, 10u, 11u, 20u}) {
      Scene scene = UnevenChains(chain_count, pulled);
      SetSubsteps(scene, 1);
      ExpectParity(GetParam(), scene, 1);
    }
  }
}

TEST_P(StripParityTest, CoincidentParticlesActAlongX) {
  Scene scene = Particles({{{0, 0, 0}, {0.25, 0, 0}}, {1, 3}, {{0, 1, 0.25, 0}}, {}});
  scene.state.positions_m[1] = scene.state.positions_m[0];
  scene.parameters.gravity_m_per_s2.setZero();
  SetSubsteps(scene, 1, 2);
  ExpectParity(GetParam(), scene, 1);
}

// The pins of a chain.
struct ChainPins {
  std::string name;
  bool first = false, middle = false, last = false;
};

const std::vector<ChainPins>& AllChainPins() {
  static const auto& all = *new std::vector<ChainPins>{
      {"free", false, false, false},       {"by_its_first", true, false, false},
      {"by_its_last", false, false, true}, {"by_its_middle", false, true, false},
      {"by_its_ends", true, false, true},  {"by_all_three", true, true, true}};
  return all;
}

// Of the longest chain. Lanes have a particle each, as in small cloths; four, and as many of them
// as there may be (gl_compute/strip_lanes.h); the last is too long for lanes.
constexpr uint32_t kMostLinks[] = {28, 31, 32};
constexpr double kLink_m = 0.05;

// Side by side chains of 1, 2, ... links, which turn by up to twice `bend` radians from link to
// link and whose neighbours do not weigh the same: every other particle mass_ratio times as much.
// chain_of: [particle_count].
Scene Chains(uint32_t most_links, const ChainPins& chain_pins, double bend,
             std::vector<uint32_t>& chain_of, double mass_ratio = 1) {
  ParticleTopology particles;
  std::vector<uint32_t> pins;
  for (uint32_t links = 1; links <= most_links; ++links) {
    Vector3d p(0, 0, 2.0 * kLink_m * links);
    for (uint32_t k = 0; k <= links; ++k) {
      const auto i = static_cast<uint32_t>(particles.positions_m.size());
      particles.positions_m.push_back(p);
      const double mass_kg = 0.01 + 0.007 * ((3 * k + links) % 5);
      particles.masses_kg.push_back(k % 2 == 0 ? mass_kg : mass_kg * mass_ratio);
      if (k > 0) particles.distance_constraints.push_back({i - 1, i, kLink_m, 0});
      const bool is_pin = (k == 0 && chain_pins.first) || (k == links / 2 && chain_pins.middle) ||
                          (k == links && chain_pins.last);
      if (is_pin) pins.push_back(i);
      chain_of.push_back(links);
      const double angle = bend * std::sin(2.0 * k + links);
      p += kLink_m * Vector3d(std::cos(angle), std::sin(angle), 0);
    }
  }
  Scene scene = Particles(particles, pins);
  scene.name = "chains_" + chain_pins.name + "_" + std::to_string(most_links);
  scene.parameters.gravity_m_per_s2.setZero();
  SetSubsteps(scene, 1);
  return scene;
}

TEST_P(StripParityTest, EveryLengthAndPlaceOfPins) {
  for (const uint32_t most_links : kMostLinks) {
    for (const ChainPins& chain_pins : AllChainPins()) {
      for (const Direction direction : {Direction::kAtEnd, Direction::kAtStart}) {
        std::vector<uint32_t> chain_of;
        Scene scene = Chains(most_links, chain_pins, 0.5, chain_of);
        Stir(scene, 0.3);
        scene.parameters.settings.integration = Integration::kOneStep;
        scene.parameters.settings.direction = direction;
        ExpectParity(GetParam(), scene, 1);
      }
    }
  }
}

void ExpectParityOfTautRows(const std::string& backend, uint32_t most_links,
                            const ChainPins& chain_pins, double bend) {
  std::vector<uint32_t> chain_of;
  Scene scene = Chains(most_links, chain_pins, bend, chain_of);
  scene.name += "_bent_by_" + std::to_string(bend);
  for (uint32_t i = 0; i < chain_of.size(); ++i) {
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    scene.state.velocities_m_per_s[i] =
        0.01 * Vector3d(std::cos(2.4 * i), std::sin(7.2 * i), std::sin(2.4 * i));
  }
  ExpectParity(backend, scene, 1);
}

// Between two pins one constraint is nearly or fully redundant.
TEST_P(StripParityTest, TautRowsBetweenPins) {
  for (const uint32_t most_links : kMostLinks) {
    for (const double bend : {0.0, 1e-5, 1e-3, 1e-2}) {
      for (const ChainPins& chain_pins : AllChainPins()) {
        ExpectParityOfTautRows(GetParam(), most_links, chain_pins, bend);
      }
    }
  }
}

// The largest distance of a backend's velocities from the reference's after a step [m/s].
double LargestError(const std::string& backend_name, const Scene& scene) {
  const auto step = [&](const std::string& name) {
    Backend& backend = SharedBackend(name);
    const ClothHandle cloth = CreateCloth(backend, scene);
    StepAlone(backend, cloth, scene);
    ParticleState state = ReadState(backend, cloth);
    backend.Destroy(cloth);
    return state;
  };
  return FindWorst(step(backend_name).velocities_m_per_s, step("reference").velocities_m_per_s)
      .distance;
}

// With very different masses of neighbours the matrix is nearly singular, and errors are beyond the
// bounds of round_off.h, for elimination too. Reduction has 35 roundings where elimination has 8
// (round_off.h), so its errors may be larger by that factor, not more: pivots by differences
// instead of sums of one sign would make them tens of times as large. At 1 : 10^4 elimination gains
// more from solving such chains three times than reduction does.
TEST(StripReductionTest, UnequalMassesAreNoWorseThanByElimination) {
  for (const uint32_t most_links : kMostLinks) {
    for (const double mass_ratio : {1e2, 1e3}) {
      for (const ChainPins& chain_pins : AllChainPins()) {
        double by_elimination = 0, by_reduction = 0;
        for (const double bend : {0.0, 0.1, 0.5}) {
          std::vector<uint32_t> chain_of;
          Scene scene = Chains(most_links, chain_pins, bend, chain_of, mass_ratio);
          Stir(scene, 0.1);
          RoundToFloat(scene.state.positions_m);
          RoundToFloat(scene.state.velocities_m_per_s);
          by_elimination = std::max(by_elimination, LargestError("gl_elimination", scene));
          by_reduction = std::max(by_reduction, LargestError("gl_reduction", scene));
        }
        EXPECT_LE(by_reduction, 35.0 / 8 * by_elimination)
            << chain_pins.name << " of " << most_links << " links, mass ratio " << mass_ratio;
      }
    }
  }
}

// Every other chain moves; those at rest keep their bits, which a solve would change, because their
// lengths are rounded.
TEST_P(StripParityTest, AStripWithinTheToleranceIsLeftAlone) {
  constexpr uint32_t kMost = kMostLinks[0];
  std::vector<uint32_t> chain_of;
  Scene scene = Chains(kMost, AllChainPins()[1], 0.5, chain_of);
  RoundToFloat(scene.state.positions_m);
  const Scene at_rest = scene;
  Stir(scene, 1);
  for (size_t i = 0; i < chain_of.size(); ++i) {
    if (chain_of[i] % 2 == 0) scene.state.velocities_m_per_s[i].setZero();
  }
  Backend& backend = SharedBackend(GetParam());
  for (const double tolerance : {0.0, 1e-4}) {
    scene.parameters.settings.tolerance = tolerance;
    const ClothHandle cloth = CreateCloth(backend, scene);
    const StepReport report = StepAlone(backend, cloth, scene);
    EXPECT_EQ(report.converged, tolerance == 0);  // all of them were requested
    const ParticleState state = ReadState(backend, cloth);
    std::vector<bool> has_moved(kMost + 1, false);
    for (size_t i = 0; i < chain_of.size(); ++i) {
      if (state.positions_m[i] != scene.state.positions_m[i]) has_moved[chain_of[i]] = true;
    }
    uint32_t moved_of_resting = 0;
    for (uint32_t links = 1; links <= kMost; ++links) {
      if (links % 2 == 1) {
        EXPECT_TRUE(has_moved[links]) << links << " links";
      } else {
        moved_of_resting += has_moved[links];
      }
    }
    if (tolerance > 0) {
      EXPECT_EQ(moved_of_resting, 0u);
    } else {
      EXPECT_GT(moved_of_resting, kMost / 4) << "the tolerance would make no difference";
    }
    backend.Destroy(cloth);
  }
  Scene resting = at_rest;
  resting.parameters.settings.tolerance = 1e-4;
  const ClothHandle cloth = CreateCloth(backend, resting);
  const StepReport report = StepAlone(backend, cloth, resting);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.iterations, 1u);
  backend.Destroy(cloth);
}

// Impulses along the links as they were at the start of the substep, or between. No gravity:
// BLENDED is AT_START; some links turn so far that they have the end.
TEST_P(StripParityTest, StartDirections) {
  for (const uint32_t particle_count : {2u, 31u, 33u, 1025u}) {
    for (const Sweep sweep : {Sweep::kColours, Sweep::kStrips}) {
      for (const double speed_m_per_s : {0.1, 3.0}) {
        Scene scene = SizedCloth(particle_count);
        Stir(scene, speed_m_per_s);
        scene.parameters.gravity_m_per_s2.setZero();
        scene.parameters.settings.sweep = sweep;
        scene.parameters.settings.integration = Integration::kOneStep;
        scene.parameters.settings.direction = Direction::kAtStart;
        SetSubsteps(scene, 1, 2);
        ExpectParity(GetParam(), scene, 1);
      }
    }
  }
}

TEST_P(StripParityTest, BlendedDirections) {
  for (const Sweep sweep : {Sweep::kColours, Sweep::kStrips}) {
    Scene scene = Net(7, 0.2, 1e-5);
    Stir(scene, 0.5);
    scene.parameters.settings.sweep = sweep;
    scene.parameters.settings.integration = Integration::kOneStep;
    scene.parameters.settings.direction = Direction::kBlended;
    SetSubsteps(scene, 1, 2);
    StepSettings& settings = scene.parameters.settings;
    settings.time_step_s *= std::sqrt(0.006 / LoadRatio(*scene.model, scene.parameters));
    const double end_share = PlanOf(scene).solver.end_share;
    ASSERT_GT(end_share, 0.1);
    ASSERT_LT(end_share, 0.9);
    ExpectParity(GetParam(), scene, 1);
  }
}

// Rows and columns between pins, of heavy sheets: by lanes of one particle or four, and tiled.
TEST_P(StripParityTest, SpansThatGiveWay) {
  for (const uint32_t side : {9u, 24u, 33u}) {
    Scene scene = Grid(side, side, 0.5, 0.5, {0, side - 1, side * (side - 1)});
    scene.name = "spans_" + std::to_string(side);
    Stir(scene, 1);
    scene.parameters.settings.sweep = Sweep::kStrips;
    SetSubsteps(scene, 1, 2);
    ASSERT_GT(PlanOf(scene).solver.span_give, 0.01);
    ExpectParity(GetParam(), scene, 1);
  }
}

}  // namespace
}  // namespace drape::test
