// The quantities of states that are made by hand.
#include "tests/bench/accuracy/quantities.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/bench/accuracy/fabric_scenes.h"
#include "tests/bench/accuracy/resting_scenes.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// The start, each particle moved by `moves_m` in one state after the other.
std::vector<ParticleState> Moved(const QuantityScene& scene, const std::vector<Vector3d>& moves_m) {
  std::vector<ParticleState> states(moves_m.size(), scene.scene.state);
  for (size_t k = 0; k < moves_m.size(); ++k) {
    for (Vector3d& p : states[k].positions_m) p += moves_m[k];
  }
  return states;
}

TEST(QuantitiesTest, TrembleIsTheSecondDifferenceOverFrames) {
  const QuantityScene scene = RestScenes(/*is_quick=*/true).front();
  const auto steady = Moved(scene, {{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}});
  const auto jerk = Moved(scene, {{0, 0, 0}, {0.1, 0, 0}, {0.2, 0.003, 0}, {0.3, 0.006, 0}});
  EXPECT_NEAR(scene.quantities[1].of(steady), 0, 1e-15);
  EXPECT_NEAR(scene.quantities[0].of(jerk), 0.003 / std::sqrt(2.0), 1e-12) << "RMS";
  EXPECT_NEAR(scene.quantities[1].of(jerk), 0.003, 1e-12) << "max";
}

TEST(QuantitiesTest, SlopesMeasureTheWay) {
  const QuantityScene scene = SlopeScenes(/*is_quick=*/true).front();
  EXPECT_NEAR(scene.quantities[0].of(Moved(scene, {{0.3, -0.4, 0}})), 0.5, 1e-12);
}

TEST(QuantitiesTest, CantileversMeasureTheDrop) {
  const QuantityScene scene = CantileverScenes(/*is_quick=*/true).front();
  EXPECT_NEAR(scene.quantities[0].of(Moved(scene, {{0.3, -0.4, 0}})), 0.4, 1e-12);
  // w L^4 / 8B would be 5/8 L; the overhang is 8 of 9 cells.
  const double overhang_m = scene.scene.state.positions_m[9].x() * 8 / 9;
  EXPECT_GT(*scene.quantities[0].expected, 0.4 * overhang_m);
  EXPECT_LT(*scene.quantities[0].expected, 5.0 / 8 * overhang_m);
}

TEST(QuantitiesTest, StrainsAreThoseOfTheLinks) {
  const QuantityScene scene = GarmentScenes(/*is_quick=*/true).front();
  std::vector<ParticleState> states = {scene.scene.state};
  for (const Quantity& quantity : scene.quantities) EXPECT_NEAR(quantity.of(states), 0, 1e-12);
  for (Vector3d& p : states[0].positions_m) p *= 0.75;
  for (const Quantity& quantity : scene.quantities) EXPECT_NEAR(quantity.of(states), 0.25, 1e-12);
}

TEST(QuantitiesTest, CapstansMeasureHowFarTheLoadSinks) {
  const QuantityScene scene = CapstanScenes(/*is_quick=*/true).front();
  const auto states = Moved(scene, {{0, -0.1, 0}, {0, -0.2, 0}, {0.5, -0.4, 0.5}});
  EXPECT_NEAR(scene.quantities[0].of(states), 0.3, 1e-12);
}

TEST(QuantitiesTest, CatchesMeasureTheLargestStrainOfAnyFrame) {
  const QuantityScene scene = CatchScenes(/*is_quick=*/true).front();
  std::vector<ParticleState> states(3, scene.scene.state);
  EXPECT_NEAR(scene.quantities[0].of(states), 0, 1e-12);
  for (Vector3d& p : states[1].positions_m) p *= 1.25;
  for (Vector3d& p : states[2].positions_m) p *= 0.9;
  EXPECT_NEAR(scene.quantities[0].of(states), 0.25, 1e-12);
}

// Flat, and shrunk to half its side about its middle.
TEST(QuantitiesTest, TheDrapeCoefficientIsThatOfTheShadow) {
  const QuantityScene scene = DrapeScenes(/*is_quick=*/true).front();
  std::vector<ParticleState> states = {scene.scene.state};
  EXPECT_NEAR(scene.quantities[0].of(states), 1, 0.01);
  const Vector3d middle_m(0.15, 0, 0.15);
  for (Vector3d& p : states[0].positions_m) p = middle_m + (p - middle_m) / 2;
  const double table_m2 = std::numbers::pi * 0.09 * 0.09;
  EXPECT_NEAR(scene.quantities[0].of(states), (0.0225 - table_m2) / (0.09 - table_m2), 0.01);
}

TEST(QuantitiesTest, SagIsThatOfTheFirstRow) {
  const QuantityScene scene = SagScenesBySide(/*is_quick=*/true).front();
  for (const DistanceConstraint& link : scene.scene.model->constraints()) {
    const auto& p_m = scene.scene.state.positions_m;
    EXPECT_NEAR((p_m[link.j] - p_m[link.i]).norm(), link.rest_length_m, 1e-9) << "at the start";
  }
  EXPECT_NEAR((scene.scene.state.positions_m[7] - scene.scene.state.positions_m[0]).norm(), 0.9,
              1e-9);
  const auto start = Moved(scene, {Vector3d::Zero()}), lowered = Moved(scene, {{0, -0.25, 0}});
  EXPECT_NEAR(scene.quantities[0].of(start), 0, 1e-12);
  EXPECT_NEAR(scene.quantities[1].of(start), 0.5, 1e-12);
  EXPECT_NEAR(scene.quantities[0].of(lowered), 0.25, 1e-12);
  EXPECT_NEAR(scene.quantities[1].of(lowered), 0.75, 1e-12);
}

}  // namespace
}  // namespace drape::bench
