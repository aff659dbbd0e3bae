// Gains of energy that each are small do not add up: steps that would add to what a cloth has
// gained are done again more dissipatively, or lose it again (StepItem::energy).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "server/solver/energy_watch.h"
#include "server/solver/solver_constants.h"
#include "tests/support/backends/backends.h"
#include "tests/support/random_cloths.h"
#include "tests/support/reports.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

TEST(EnergyLimit, CountsFromWhereNothingElseHasPart) {
  const EnergyLimit limit{.is_watched = true, .scale_j = 10};
  const EnergyBalance first = limit.After({}, {.start_kinetic_j = 5, .gain_j = 0.02});
  EXPECT_EQ(first.gain_j, 0.02);
  EXPECT_EQ(first.scale_j, 15) << "m g l and the kinetic energy at the beginning";
  const EnergyBalance second = limit.After(first, {.start_kinetic_j = 7, .gain_j = 0.03});
  EXPECT_EQ(second.gain_j, 0.05);
  EXPECT_EQ(second.scale_j, 15);
}

TEST(EnergyLimit, TellsWhatOfAStepIsTooMuch) {
  const EnergyLimit limit{.is_watched = true, .scale_j = 10};
  const double most_j = kMaxEnergyGrowth * 10 + kMaxEnergyDrift * 4;
  const auto excess_j = [&](double gain_before_j, double step_j) {
    const EnergyChange step{.start_kinetic_j = 4, .gain_j = step_j};
    return limit.Excess_j(limit.After({gain_before_j, 10}, step), step);
  };
  EXPECT_EQ(excess_j(0, most_j), 0);
  EXPECT_NEAR(excess_j(0, most_j + 0.1), 0.1, 1e-12);
  EXPECT_EQ(excess_j(2 * most_j, 0.1), 0.1) << "no more than the step has added";
  EXPECT_EQ(excess_j(2 * most_j, -0.1), 0);
  EXPECT_EQ(excess_j(-1, 0.9), 0) << "it has lost more before";
}

TEST(EnergyLimit, VelocitiesLoseTheEnergyThatIsAsked) {
  EXPECT_DOUBLE_EQ(ShareOfVelocities(8, 6), 0.5);
  EXPECT_EQ(ShareOfVelocities(8, 9), 0);
  EXPECT_EQ(ShareOfVelocities(0, 0), 0);
}

// Squares of four particles in a row, each particle linked with the others of its square and with
// three in four of those of the next one; one of them is 1000 times as heavy as the others.
Scene Beam(uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](uint32_t count) { return static_cast<uint32_t>(random() % count); };
  ParticleTopology beam;
  const uint32_t squares = 3 + below(6), count = 4 * squares;
  for (uint32_t i = 0; i < count; ++i) {
    beam.positions_m.push_back(0.1 * Vector3d(i / 4, i / 2 % 2, i % 2));
    beam.masses_kg.push_back(0.01);
  }
  beam.masses_kg[below(count)] = 10;
  for (uint32_t j = 0; j < count; ++j) {
    for (uint32_t i = j < 4 ? 0 : j / 4 * 4 - 4; i < j; ++i) {
      if (i / 4 != j / 4 && below(4) == 0) continue;
      const double length_m = (beam.positions_m[j] - beam.positions_m[i]).norm();
      beam.distance_constraints.push_back({.i = i, .j = j, .rest_length_m = length_m});
    }
  }
  Scene scene = Particles(beam, {below(count)});
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.sleep_motion_m = 0;
  return scene;
}

class EnergyBalanceTest : public testing::TestWithParam<std::string> {
 protected:
  Backend& backend() { return SharedBackend(GetParam()); }

  // The most that each has gained at the end of any of so many steps, as a share of its scale.
  // `are_summed`: each step knows what those before it have added.
  std::vector<double> LargestGains(const std::vector<Scene>& scenes, int steps, bool are_summed) {
    std::vector<StepItem> items;
    std::vector<double> starts_j, largest(scenes.size());
    for (const Scene& scene : scenes) {
      items.push_back({.cloth = CreateCloth(backend(), scene), .pin_targets_m = {}});
      if (are_summed) items.back().energy = EnergyBalance{};
      starts_j.push_back(Energy_j(scene, ReadState(backend(), items.back().cloth), 0));
    }
    for (int step = 0; step < steps; ++step) {
      const BatchReport batch = backend().Step(items);
      for (size_t k = 0; k < scenes.size(); ++k) {
        const StepReport& report = batch.reports[k];
        EXPECT_EQ(report.fault, FaultReason::kNone);
        EXPECT_TRUE(report.energy.has_value());
        if (are_summed) items[k].energy = report.energy;
        const double now_j = Energy_j(scenes[k], ReadState(backend(), items[k].cloth), 0);
        largest[k] = std::max(largest[k], (now_j - starts_j[k]) / EnergyScale_j(scenes[k]));
      }
    }
    for (const StepItem& item : items) backend().Destroy(item.cloth);
    return largest;
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, EnergyBalanceTest, testing::Values("cpu", "reference"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(EnergyBalanceTest, SmallGainsDoNotAddUp) {
  const bool is_cpu = GetParam() == "cpu";
  std::vector<Scene> beams;
  for (uint64_t seed = 1; seed <= (is_cpu ? 40u : 16u); ++seed) beams.push_back(Beam(seed));
  const int steps = is_cpu ? 480 : 300;
  const auto are_beyond = [](double gain) { return gain > 0.01; };
  const std::vector<double> by_themselves = LargestGains(beams, steps, false);
  EXPECT_GT(std::ranges::count_if(by_themselves, are_beyond), 0) << "nothing to hold back";
  for (const double gain : LargestGains(beams, steps, true)) EXPECT_LE(gain, 0.01);
}

// Where nothing more may be gained no step adds anything, and what nothing holds keeps its
// momentum.
TEST_P(EnergyBalanceTest, WhatIsTooMuchIsTakenFromVelocities) {
  for (const RandomKind kind : {RandomKind::kLinkage, RandomKind::kFrame, RandomKind::kMesh}) {
    for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
      Scene scene = RandomCloth(kind, 7);
      ParticleTopology free;
      for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
        free.positions_m.push_back(scene.model->rest_positions_m()[i]);
        free.masses_kg.push_back(scene.model->masses_kg()[i]);
      }
      for (const DistanceConstraint& link : scene.model->constraints()) {
        free.distance_constraints.push_back(link);
      }
      scene = Particles(free);
      scene.parameters.settings = PresetSettings(preset);
      scene.parameters.gravity_m_per_s2.setZero();
      ParticleState& start = scene.state;
      double mass_kg = 0, size_j = 0;
      for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
        const Vector3d arm = start.positions_m[i] - start.positions_m[0];
        start.velocities_m_per_s[i] = Vector3d(0.5, 0.2, -0.1) + Vector3d(3, -4, 5).cross(arm);
        mass_kg += scene.model->masses_kg()[i];
        size_j += scene.model->masses_kg()[i] * start.velocities_m_per_s[i].squaredNorm() / 2;
      }
      const auto momentum = [&](const ParticleState& state) {
        Vector3d sum = Vector3d::Zero();
        for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
          sum += scene.model->masses_kg()[i] * state.velocities_m_per_s[i];
        }
        return sum;
      };
      const ClothHandle cloth = CreateCloth(backend(), scene);
      const double rounding = 64 * UnitRoundOff(backend()) * scene.model->particle_count();
      StepItem item{.cloth = cloth, .pin_targets_m = {}, .energy = EnergyBalance{1e6, 1e-6}};
      double before_j = Energy_j(scene, ReadState(backend(), cloth), 0);
      for (int step = 0; step < 60; ++step) {
        const StepReport report = backend().Step({&item, 1}).reports[0];
        const ParticleState now = ReadState(backend(), cloth);
        const double now_j = Energy_j(scene, now, 0);
        EXPECT_LE(now_j, before_j + kMaxEnergyDrift * before_j + rounding * size_j)
            << scene.name << " " << step;
        ASSERT_TRUE(report.energy.has_value());
        before_j = now_j;
        const double scale = std::sqrt(2 * mass_kg * size_j);
        EXPECT_LE((momentum(now) - momentum(start)).norm(), 60 * rounding * scale)
            << scene.name << " " << step;
      }
      backend().Destroy(cloth);
    }
  }
}

}  // namespace
}  // namespace drape::test
