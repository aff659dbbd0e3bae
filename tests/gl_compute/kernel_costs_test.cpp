#include "server/solver/gl_compute/kernel_costs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

LoopCosts CountLoops(const SceneModel& model, const ClothParameters& parameters,
                     uint32_t local_size, StripSolve strip_solve = StripSolve::kElimination) {
  return CountResidentLoops(PlanOnDevice(model, parameters), local_size, strip_solve);
}

// The watch of energy of a cloth without pins: 32 sums over its particles, and their sum; two
// passes more for each loop's end.
uint64_t WatchPasses(uint64_t particles, uint64_t local_size) {
  return 32 / local_size * (1 + ((particles + 31) / 32 + 2) + 2) + 2 + 32 + 2;
}
// What it adds, with a group of 32, for what links and elastic elements store; no joints.
uint64_t StoredPasses(uint64_t links, uint64_t elements) {
  return 1 + ((links + 31) / 32 + 2) + 2 + ((elements + 31) / 32 + 2) + 2 + 32 + 2;
}

// llvmpipe leaves every loop after 65535 passes in one invocation, without an error. In small
// models the cost of a loop besides its rounds is most of the count: the longest step of one
// dispatch, a little longer ones and much longer ones must all make every sweep.
TEST(KernelCostsTest, LongStepsOfChainsAreNotCutShort) {
  // That of software renderers; hardware would need no second dispatch.
  const std::unique_ptr<Backend> backend = MakeGlBackend({.loop_budget = 60'000});
  for (const uint32_t links : {1u, 3u}) {
    const auto model = BuildModel(ChainDescription(links + 1, {0}));
    for (const uint32_t sweeps : {4u, 64u}) {
      ClothParameters parameters = test::PlainParameters();
      parameters.settings.integration = Integration::kOneStep;
      parameters.settings.sweep = links == 3 ? Sweep::kStrips : Sweep::kColours;
      parameters.settings.use_tethers = links == 3;
      parameters.settings.max_iterations = sweeps;
      const auto dispatches_of = [&](uint32_t substeps) {
        parameters.settings.substeps = substeps;
        const ClothHandle cloth = CreateCloth(*backend, model, parameters);
        const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
        const BatchReport report = backend->Step({&item, 1});
        EXPECT_EQ(report.reports[0].iterations, substeps * sweeps)
            << links << " links, " << sweeps << " sweeps in " << report.dispatch_count
            << " dispatches";
        backend->Destroy(cloth);
        return report.dispatch_count;
      };
      uint32_t fits = 1, does_not = 2500;
      const uint32_t least = dispatches_of(fits);
      ASSERT_LT(least, dispatches_of(does_not));
      while (does_not - fits > 1 + fits / 50) {
        const uint32_t middle = (fits + does_not) / 2;
        (dispatches_of(middle) == least ? fits : does_not) = middle;
      }
    }
  }
}

TEST(KernelCostsTest, SweepOfAChain) {
  // 100 particles, 99 constraints in 2 colours of 50 and 49: with 32 invocations 2 rounds each.
  const auto model = BuildModel(ChainDescription(100));
  ASSERT_EQ(model->colour_count(), 2u);
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.sweep = Sweep::kColours;
  const LoopCosts costs = CountLoops(*model, parameters, 32);
  // The sweep's own pass, 2 + 2 of the colours, 2 + 2 of each colour's constraints.
  EXPECT_EQ(costs.sweep, 1u + 4 + 4 + 4);
  parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0}), PlaneThrough({0, 0, 0}, {0, 1, 0})};
  // 4 rounds over the particles, each with 2 colliders, and two more passes for each loop's end;
  // one for the loop around.
  EXPECT_EQ(CountLoops(*model, parameters, 32).sweep, costs.sweep + 1 + 6 + 4 * 4);
}

// Three loops over the 8 words of the range and one to read them, 4 rounds of particles, none of
// pins, one of colliders along 4 directions; two passes more for each loop's end.
TEST(KernelCostsTest, FindingWhatIsInReach) {
  const auto model = BuildModel(ChainDescription(100));
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.direction = Direction::kAtEnd;
  const LoopCosts free = CountLoops(*model, parameters, 32);
  parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0}), PlaneThrough({0, 0, 0}, {0, 1, 0})};
  EXPECT_EQ(CountLoops(*model, parameters, 32).fixed - free.fixed,
            4u * (8 + 2) + (4 + 2) + 2 + (1 + 4 + 2) + 2);
  parameters.colliders.resize(100);  // 24 of them may be left out, tested in two rounds of 16
  EXPECT_EQ(CountLoops(*model, parameters, 16).fixed - CountLoops(*model, parameters, 32).fixed,
            4u * 3 + 4u * 3 + 3 + (1 + 4 + 2) + WatchPasses(100, 16) - WatchPasses(100, 32));
}

// One strip of 99 links: once along it, then at most twice back in a loop around that, each with
// two passes more.
TEST(KernelCostsTest, SweepOfAChainAsAStrip) {
  const auto model = BuildModel(ChainDescription(100));
  ASSERT_EQ(model->strips().strip_count(), 1u);
  // The sweep's own pass, 1 + 2 of the phases, 1 + 2 of the strips in it.
  EXPECT_EQ(CountLoops(*model, test::PlainParameters(), 32).sweep,
            1u + 3 + 3 + 101 + 2 * (1 + 101) + 2);
}

// 8 x 8 particles: 8 strips of 8 particles in each of 2 phases, of which a group of 32 lanes
// holds 4. Each round has loops over five levels, over four groups and over 32 lanes.
TEST(KernelCostsTest, SweepByReduction) {
  const auto model = GridModel(8, 8);
  ASSERT_EQ(model->strips().phase_count(), 2u);
  ASSERT_EQ(LongestStrip(model->strips()), 7u);
  const auto sweep = [&](uint32_t local_size, StripSolve strip_solve) {
    return CountLoops(*model, test::PlainParameters(), local_size, strip_solve).sweep;
  };
  constexpr uint64_t kRound = 1 + (5 + 2) + 3 * (4 + 2) + (32 + 2);
  const uint64_t elimination = 1 + (2 + 2) + 2 * (1 + (7 + 2) + 2 * (1 + 7 + 2) + 2 + 2);
  EXPECT_EQ(sweep(32, StripSolve::kElimination), elimination);
  for (const auto how : {StripSolve::kReduction, StripSolve::kReductionWithBarriers}) {
    EXPECT_EQ(sweep(32, how), 1 + (2 + 2) + 2 * (2 * kRound + 2));
    EXPECT_EQ(sweep(64, how), 1 + (2 + 2) + 2 * (1 * kRound + 2));
  }
  // At least as many passes as by elimination, which a kernel may fall back on.
  EXPECT_LT(elimination, sweep(64, StripSolve::kReduction));
}

// 8 x 8 particles: 112 links, 4 colours of 28.
TEST(KernelCostsTest, RefinementOfEveryLink) {
  const auto model = GridModel(8, 8);
  ASSERT_EQ(model->strips().phase_count(), 2u);
  ASSERT_EQ(model->colour_count(), 4u);
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.refine_above_strain = 0;
  const LoopCosts before = CountLoops(*model, parameters, 32);
  parameters.settings.refine_above_strain = 1e-3;
  const LoopCosts after = CountLoops(*model, parameters, 32);
  // Passes of a round: two words of flags to clear, the tests, four sweeps over the colours.
  const uint64_t colours = (4 + 2) + 4 * (1 + 2);
  const uint64_t round = (1 + 2) + (4 + 2) + (4 + 2) + 4 * colours;
  EXPECT_EQ(after.sweep, before.sweep);
  EXPECT_EQ(after.substep, before.substep);
  EXPECT_EQ(after.fixed - before.fixed, 16 * (1 + round) + 2);
  parameters.settings.substeps = 3;
  EXPECT_EQ(CountLoops(*model, parameters, 32).fixed - before.fixed, 3 * (1 + round) + 2);
  // Four sweeps, the flags of the constraints in their lists, their counts.
  EXPECT_EQ(CountTiledRefineLoops(*model, 32), (4 + 2) + 5 * colours + (4 + 2));
}

// 8 x 8 particles in 2 rounds of 32, 98 triangles in 4, at most 6 triangles per particle.
TEST(KernelCostsTest, AKickOfTheAir) {
  const auto model = GridModel(8, 8);
  ClothParameters parameters = test::PlainParameters();
  const LoopCosts calm = CountLoops(*model, parameters, 32);
  parameters.air_drag = 1;
  const LoopCosts windy = CountLoops(*model, parameters, 32);
  EXPECT_EQ(windy.substep - calm.substep, (4 + 2) + (2 + 2) + 2 * (6 + 2));
  EXPECT_EQ(windy.fixed - calm.fixed, windy.substep - calm.substep);
  EXPECT_EQ(windy.sweep, calm.sweep);
}

// 8 x 8 particles in 2 rounds of 32; 96 rods, 49 twists and 49 diagonals in 7 rounds; a particle
// inside is in 6 rods, 4 twists and, every second one, 4 diagonals.
TEST(KernelCostsTest, AKickOfElasticElements) {
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  const auto plain = GridModel(8, 8);
  const auto elastic = BuildModel(
      {GridTopology{8, 8, 1, 1}, {.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 10}, {}});
  ASSERT_EQ(elastic->elastic_count(), 96u + 49 + 49);
  const LoopCosts before = CountLoops(*plain, parameters, 32);
  const LoopCosts after = CountLoops(*elastic, parameters, 32);
  EXPECT_EQ(after.substep - before.substep, (7 + 2) + (2 + 2) + 2 * (14 + 2));
  EXPECT_EQ(after.fixed - before.fixed,
            after.substep - before.substep + StoredPasses(112, elastic->elastic_count()));
  EXPECT_EQ(after.sweep, before.sweep);
}

// Stiff elements, too fast for kicks: rods along 8 rows and 8 columns, 7 falling and 6 rising
// diagonals, 7 rows of cells: one round each of at most 8 particles, there and back. 64 particles
// get the impulses of the cells in 2 rounds.
TEST(KernelCostsTest, LinesOfElasticElements) {
  const ClothParameters parameters = test::PlainParameters();
  const auto plain = GridModel(8, 8);
  const auto elastic = BuildModel(
      {GridTopology{8, 8, 1, 1}, {.bending_rigidity_n_m = 1, .shear_modulus_n_per_m = 1e8}, {}});
  const LoopCosts before = CountLoops(*plain, parameters, 32);
  const LoopCosts after = CountLoops(*elastic, parameters, 32);
  const uint64_t family = 1 + 2 * (8 + 2) + 2;
  const uint64_t rising = family - 2;  // the longest line of them has 7 particles
  EXPECT_EQ(after.substep - before.substep, 4 * (1 + family) + (1 + rising) + 2 + (2 + 2));
  EXPECT_EQ(after.fixed, before.fixed + StoredPasses(112, elastic->elastic_count()));
  EXPECT_EQ(after.sweep, before.sweep);
}

// 8 x 8 particles in 2 rounds of 32, 98 triangles with 133 hinges in 5.
TEST(KernelCostsTest, StagesOfHinges) {
  const ClothParameters parameters = test::PlainParameters();
  test::Scene soft = test::MeshedGrid(8, 8, 1, 1);
  test::Scene stiff = test::MeshedGrid(8, 8, 1, 1, {}, {.bending_rigidity_n_m = 1e3});
  soft.parameters = stiff.parameters = parameters;
  ASSERT_EQ(stiff.model->elastic_count(), 133u);
  const uint32_t stages = test::PlanOf(stiff).solver.hinge_stages;
  ASSERT_GT(stages, 1u);
  const LoopCosts before = CountLoops(*soft.model, parameters, 32);
  const LoopCosts after = CountLoops(*stiff.model, parameters, 32);
  uint64_t most = 0;
  const std::vector<uint32_t>& offsets = stiff.model->elastic_shares().offsets;
  for (size_t i = 0; i + 1 < offsets.size(); ++i) {
    most = std::max<uint64_t>(most, offsets[i + 1] - offsets[i]);
  }
  const uint64_t kick = (5 + 2) + (2 + 2) + 2 * (most + 2);
  EXPECT_EQ(after.substep - before.substep, 2 + stages * (1 + kick));
  EXPECT_EQ(after.fixed, before.fixed + StoredPasses(161, 133));
  EXPECT_EQ(after.sweep, before.sweep);
}

TEST(KernelCostsTest, PartsCoverTheWholeStep) {
  const LoopCosts costs = {.sweep = 70, .substep = 130, .fixed = 200};
  for (const uint64_t substeps : {1u, 60u, 10'000u}) {
    for (const uint64_t iterations : {1u, 100u, 10'000u}) {
      const uint64_t parts = CountParts(costs, substeps, iterations, 60'000);
      const uint64_t total = substeps * (130 + iterations * 70);
      EXPECT_GE(parts * 60'000, total + costs.fixed);
      EXPECT_EQ(parts == 1, total + costs.fixed <= 60'000);
    }
  }
  EXPECT_TRUE(CanRunInParts(costs, 800));
  EXPECT_FALSE(CanRunInParts(costs, 799));
}

}  // namespace
}  // namespace drape
