// Sweeps: the refinement under both plans, and how many dispatches one of the tiled plan has.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/solver/gl_compute/kernel_variant.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

// Sheets of both plans that are thrown about, so that links are refined in all rounds; in the tiled
// plan, a larger work group refines where loops must be short.
TEST(GlSweepsTest, LocalSizeAndPartsDoNotChangeBitsOfARefinement) {
  const std::unique_ptr<Backend> usual = MakeGlBackend();
  std::vector<std::unique_ptr<Backend>> others;
  for (const uint32_t local_size : {8u, 64u}) {
    others.push_back(MakeGlBackend({.local_size = local_size}));
  }
  others.push_back(MakeGlBackend({.local_size = 64, .refine_local_size = 16}));
  const std::unique_ptr<Backend> in_parts = MakeGlBackend({.loop_budget = 2500});
  for (const uint32_t side : {9u, 64u}) {
    for (const double tolerance : {0.0, 1e-5}) {
      const auto model = GridModel(side, side, {0});
      ClothParameters parameters = test::PlainParameters();
      parameters.settings.substeps = 4;
      parameters.settings.max_iterations = 2;
      parameters.settings.tolerance = tolerance;
      ParticleState state = AtRest(*model);
      for (uint32_t i = 1; i < side * side; ++i) {
        state.velocities_m_per_s[i] = {std::cos(2.4 * i), 3 * std::sin(7.2 * i), std::sin(2.4 * i)};
      }
      const auto after = [&](Backend& on) {
        const ClothHandle cloth = CreateCloth(on, model, parameters, state);
        StepCloth(on, cloth);
        std::vector<float> result = ReadCloth(on, cloth);
        on.Destroy(cloth);
        return result;
      };
      const std::vector<float> plain = after(*usual);
      parameters.settings.refine_above_strain = 1e-6;
      const std::vector<float> expected = after(*usual);
      EXPECT_NE(expected, plain);
      for (const auto& other : others) EXPECT_EQ(after(*other), expected);
      EXPECT_EQ(after(*in_parts), expected);
    }
  }
}

// Threads from one knot, which all share: as many phases and colours of one cloth as there are
// dispatches in its sweep.
TEST(GlSweepsTest, SweepsOfManyPhasesAndColours) {
  const std::unique_ptr<Backend> backend = MakeGlBackend();
  ParticleTopology knot;
  knot.positions_m.push_back({0, 0, 0});
  constexpr uint32_t kThreads = 250, kLinks = 8;
  for (uint32_t thread = 0; thread < kThreads; ++thread) {
    const double angle = 2 * std::numbers::pi * thread / kThreads;
    for (uint32_t link = 1; link <= kLinks; ++link) {
      const uint32_t i = thread * kLinks + link;
      knot.positions_m.push_back({0.1 * link * std::cos(angle), 0, 0.1 * link * std::sin(angle)});
      knot.distance_constraints.push_back({link == 1 ? 0 : i - 1, i, 0.1, 0});
    }
  }
  knot.masses_kg.assign(knot.positions_m.size(), 0.01);
  const auto model = BuildModel({.topology = knot, .material = {}, .pinned_particles = {8, 608}});
  ASSERT_FALSE(IsResident(*model));
  ASSERT_GT(model->strips().phase_count(), 100u);
  ASSERT_GT(model->colour_count(), 200u);
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.max_iterations = 400;
  parameters.settings.tolerance = 0.02;
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    parameters.settings.sweep = sweep;
    const ClothHandle cloth = CreateCloth(*backend, model, parameters);
    const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = true};
    const BatchReport report = backend->Step({&item, 1});
    EXPECT_TRUE(report.reports[0].converged);
    EXPECT_LE(report.reports[0].measured.max_strain, 0.02 + 1e-4);
    EXPECT_LT(ReadCloth(*backend, cloth)[1], 0) << "the knot falls";
    backend->Destroy(cloth);
  }
}

}  // namespace
}  // namespace drape
