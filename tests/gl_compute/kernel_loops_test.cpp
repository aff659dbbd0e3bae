// Steps of very small cloths with very many sweeps, in which uncounted passes of a sweep's loops
// weigh most. A driver that cuts loops (server/gl/drivers.md) would stop such a step in the middle.
#include <gtest/gtest.h>

#include "server/solver/step_plan.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

// Two rods with the given number of joints.
std::shared_ptr<const SceneModel> Rods(uint32_t joint_count) {
  ParticleTopology rods;
  rods.positions_m = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0.5}, {0, 0.2, 0.5}};
  rods.masses_kg = {1, 0.5, 0.25, 0.5};
  rods.distance_constraints = {{0, 1, 1, 0}, {1, 2, 0.5, 0}};
  for (uint32_t k = 0; k < joint_count; ++k) rods.point_joints.push_back({3, k, 1e-3});
  return BuildModel({.topology = rods, .material = {}, .pinned_particles = {0}});
}

TEST(KernelLoopsTest, ManySweepsOfFewConstraintsAreNotCutShort) {
  for (const uint32_t joint_count : {0u, 1u, 3u}) {
    for (const size_t collider_count : {0u, 1u}) {
      const auto model = Rods(joint_count);
      ClothParameters parameters = test::PlainParameters();
      parameters.colliders.assign(collider_count, SphereAt({0, -0.5, 0}, 0.1));
      parameters.settings.time_step_s = 0.4;
      parameters.settings.substeps = 40;
      parameters.settings.max_iterations = 300;
      parameters.settings.use_tethers = false;
      parameters.settings.integration = Integration::kOneStep;
      SCOPED_TRACE(testing::Message() << joint_count << " joints, " << collider_count);
      ExpectCutsChangeNothing({}, model, parameters, 40 * 300);
    }
  }
}

// A strain below the resolution of squared floats: nearly all links are refined in every round.
TEST(KernelLoopsTest, RefinementOfFewLinksIsNotCutShort) {
  const auto model = GridModel(3, 3, {0});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.time_step_s = 0.4;
  parameters.settings.substeps = 40;
  parameters.settings.max_iterations = 100;
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.direction = Direction::kAtEnd;
  parameters.settings.refine_above_strain = 1e-9;
  ASSERT_TRUE(PlanStep(*model, parameters, LengthSource::kModel, ScalarType::kFloat32)
                  .solver.refine_above_strain > 0);
  ExpectCutsChangeNothing({}, model, parameters, 40 * 100);
}

}  // namespace
}  // namespace drape
