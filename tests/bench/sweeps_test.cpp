// The benchmark's own sweeps compute the same as the product's, and its orders are as described.
#include "tests/bench/sweeps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/orders.h"
#include "tests/bench/quantiles.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

using testing::ElementsAreArray;
using testing::Not;

constexpr uint32_t kMostSweeps = 2000;

StepSettings ConvergedSettings() {
  StepSettings settings = PresetSettings(Preset::kPaper);
  settings.max_iterations = kMostSweeps;
  return settings;
}

// A sheet a few steps after its release, so that every constraint has an error.
test::Scene MovingSheet(uint32_t particles, Pins pins) {
  Backend& reference = test::SharedBackend("reference");
  test::Scene scene = Sheet(particles, pins, ConvergedSettings());
  const ClothHandle cloth = test::CreateCloth(reference, scene);
  test::StepAlone(reference, cloth, scene, 12);
  scene.state = test::ReadState(reference, cloth);
  reference.Destroy(cloth);
  return scene;
}

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

Pairs PairsOf(std::span<const DistanceConstraint> constraints) {
  Pairs pairs;
  for (const DistanceConstraint& c : constraints) pairs.emplace_back(c.i, c.j);
  return pairs;
}

// The set of the constraints, in any order.
Pairs SortedPairs(std::span<const DistanceConstraint> constraints) {
  Pairs pairs = PairsOf(constraints);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

TEST(SweepsTest, InTheModelsOrderTheyAreThoseOfTheReference) {
  Backend& reference = test::SharedBackend("reference");
  for (const Pins pins : {Pins::kCorners, Pins::kEdge}) {
    const test::Scene scene = MovingSheet(128, pins);
    SweepProblem problem =
        PredictSubstep(*scene.model, scene.state, scene.parameters.gravity_m_per_s2, 1.0 / 60);
    const double tolerance = scene.parameters.settings.tolerance;
    const uint32_t sweeps =
        SweepsUntil(problem, scene.model->constraints(), tolerance, kMostSweeps);
    const ClothHandle cloth = test::CreateCloth(reference, scene);
    EXPECT_EQ(test::StepAlone(reference, cloth, scene).iterations, sweeps);
    EXPECT_GT(sweeps, 10u) << "a scene without work shows nothing";

    for (uint32_t sweep = 0; sweep < sweeps; ++sweep) {
      Sweep(problem, scene.model->constraints(), tolerance);
    }
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      problem.positions_m[i] += problem.substep_s * problem.mean_velocities_m_per_s[i];
    }
    const test::WorstOffender worst =
        test::FindWorst(problem.positions_m, test::ReadState(reference, cloth).positions_m);
    EXPECT_EQ(worst.distance, 0) << worst.message;
    reference.Destroy(cloth);
  }
}

TEST(SweepsTest, ErrorFallsWithTheSweeps) {
  const test::Scene scene = MovingSheet(64, Pins::kEdge);
  const SweepProblem problem =
      PredictSubstep(*scene.model, scene.state, scene.parameters.gravity_m_per_s2, 1.0 / 60);
  const RelativeError before = ErrorAfter(problem, scene.model->constraints(), 0);
  const RelativeError after = ErrorAfter(problem, scene.model->constraints(), 200);
  EXPECT_LT(after.max, before.max / 10);
  EXPECT_LE(after.rms, after.max);
}

TEST(OrdersTest, EveryOrderHasTheSameConstraints) {
  const test::Scene scene = Skirt(12, 5, ConvergedSettings());
  const SceneModel& model = *scene.model;
  std::mt19937 random(7);
  for (const ConstraintOrder& order :
       {ModelOrder(model), ShuffleColours(model, random), ShuffleInput(model, random),
        ShuffleAll(model, random), FromPins(model), TowardsPins(model)}) {
    EXPECT_THAT(SortedPairs(order.constraints), ElementsAreArray(SortedPairs(model.constraints())));
  }
}

TEST(OrdersTest, ShuffledColoursAreTheModelsColoursInAnotherOrder) {
  const test::Scene scene = Skirt(12, 5, ConvergedSettings());
  const SceneModel& model = *scene.model;
  std::mt19937 random(7);
  const ConstraintOrder order = ShuffleColours(model, random);
  EXPECT_EQ(order.colours, model.colour_count());
  EXPECT_THAT(PairsOf(order.constraints), Not(ElementsAreArray(PairsOf(model.constraints()))));
  // Runs without a shared particle: at most as many as there are colours.
  uint32_t runs = 1;
  std::set<uint32_t> seen;
  for (const DistanceConstraint& c : order.constraints) {
    if (seen.contains(c.i) || seen.contains(c.j)) {
      ++runs;
      seen.clear();
    }
    seen.insert({c.i, c.j});
  }
  EXPECT_LE(runs, model.colour_count());
}

TEST(OrdersTest, FromPinsStartsAtThePins) {
  const test::Scene scene = Sheet(64, Pins::kEdge, ConvergedSettings());
  const ConstraintOrder order = FromPins(*scene.model);
  EXPECT_LT(std::min(order.constraints.front().i, order.constraints.front().j), 8u);
  EXPECT_GE(std::max(order.constraints.back().i, order.constraints.back().j), 56u);
}

TEST(QuantilesTest, AreLinearBetweenTheValues) {
  const std::vector<double> values = {4, 1, 3, 2};
  EXPECT_EQ(Quantile(values, 0), 1);
  EXPECT_EQ(Quantile(values, 0.5), 2.5);
  EXPECT_NEAR(Quantile(values, 0.9), 3.7, 1e-12);
  EXPECT_EQ(Quantile(values, 1), 4);
}

}  // namespace
}  // namespace drape::bench
