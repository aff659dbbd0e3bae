#include "server/solver/gl_compute/kernel_variant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/solver/gl_compute/kernel_costs.h"
#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr DeviceTraits kSoftware = {.is_software = true, .local_size = 0, .loop_budget = 60'000};
constexpr DeviceTraits kHardware = {.is_software = false, .local_size = 0, .loop_budget = 1u << 24};

KernelVariant VariantOf(const SceneModel& model, const ClothParameters& parameters,
                        const DeviceTraits& device = kHardware) {
  const Result<VariantChoice> choice = ChooseVariant(model, parameters, device);
  DRAPE_CHECK(choice.ok(), choice.status().ToString());
  return choice->variant;
}

TEST(KernelVariantTest, CapacityFollowsTheParticleCount) {
  for (const auto& [count, capacity] : {std::pair{1u, 64u},
                                        {64u, 64u},
                                        {65u, 256u},
                                        {256u, 256u},
                                        {257u, 1024u},
                                        {1024u, 1024u},
                                        {1025u, 0u}}) {
    const KernelVariant variant = VariantOf(*BuildModel(ChainDescription(count)), {});
    EXPECT_EQ(variant.capacity, capacity) << count;
    EXPECT_EQ(variant.is_tiled(), capacity == 0) << count;
    EXPECT_EQ(IsResident(*BuildModel(ChainDescription(count))), capacity != 0) << count;
  }
}

TEST(KernelVariantTest, LocalSizeFollowsTheDevice) {
  const auto model = GridModel(32, 32);
  EXPECT_EQ(VariantOf(*model, {}, kSoftware).local_size, 32u);
  EXPECT_EQ(VariantOf(*model, {}, kHardware).local_size, 256u);
  EXPECT_EQ(VariantOf(*GridModel(8, 8), {}, kHardware).local_size, 64u);
  DeviceTraits chosen = kHardware;
  chosen.local_size = 16;
  EXPECT_EQ(VariantOf(*model, {}, chosen).local_size, 16u);
}

TEST(KernelVariantTest, LeavesOutWhatTheClothDoesNotHave) {
  const std::string bare = VariantOf(*GridModel(4, 4), {}).Defines();
  for (const char* word : {"SPRINGS", "COMPLIANCE", "CONTACTS", "CAPSULES", "BOXES", "FRICTION",
                           "DAMPING", "PINS", "TOLERANCE", "PARTS"}) {
    EXPECT_THAT(bare, Not(HasSubstr(word)));
  }
  ModelDescription description = GridDescription(4, 4, {0});
  description.material.stretch_compliance_m_per_n = 1e-4;
  description.material.bending_stiffness_n_per_m = 1;
  ClothParameters parameters;
  parameters.colliders = {PlaneCollider{}};
  parameters.friction_static = 0.3;
  parameters.damping_per_s = 1;
  parameters.air_lift = 1;
  parameters.settings.tolerance = 1e-3;
  const auto model = BuildModel(description);
  const std::string full = VariantOf(*model, parameters).Defines();
  for (const char* word : {"SPRINGS_HALF_KICKS", "HAS_COMPLIANCE", "HAS_CONTACTS", "HAS_FRICTION",
                           "HAS_DAMPING", "HAS_PINS", "HAS_TOLERANCE", "HAS_WIND"}) {
    EXPECT_THAT(full, HasSubstr(word));
  }
  EXPECT_THAT(full, Not(HasSubstr("CAPSULES")));
  EXPECT_THAT(full, Not(HasSubstr("BOXES")));
  parameters.colliders = {CapsuleCollider{}, BoxCollider{}};
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_CAPSULES\n"));
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_BOXES\n"));
  parameters.settings.spring_integration = SpringIntegration::kInForce;
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("SPRINGS_IN_FORCE"));
  parameters.colliders.clear();
  EXPECT_FALSE(VariantOf(*model, parameters).has_friction) << "no friction without colliders";
}

TEST(KernelVariantTest, LongStepsRunInPartsOnSoftwareOnly) {
  const auto model = GridModel(32, 32);
  ClothParameters parameters;
  parameters.settings = PresetSettings(Preset::kAccurate);
  EXPECT_FALSE(VariantOf(*model, parameters, kHardware).is_in_parts);
  const Result<VariantChoice> choice = ChooseVariant(*model, parameters, kSoftware);
  ASSERT_TRUE(choice.ok());
  EXPECT_TRUE(choice->variant.is_in_parts);
  EXPECT_GT(choice->part_count, 1u);
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime}) {
    parameters.settings = PresetSettings(preset);
    EXPECT_FALSE(VariantOf(*model, parameters, kSoftware).is_in_parts);
  }
}

TEST(KernelCostsTest, SweepOfAChain) {
  // 100 particles, 99 constraints in 2 colours of 50 and 49: with 32 invocations 2 rounds each.
  const auto model = BuildModel(ChainDescription(100));
  ASSERT_EQ(model->colour_count(), 2u);
  ClothParameters parameters;
  parameters.settings.sweep = Sweep::kColours;
  const LoopCosts costs = CountResidentLoops(*model, parameters, 32);
  // The sweep's own pass, 2 + 2 of the colours, 2 + 2 of each colour's constraints.
  EXPECT_EQ(costs.sweep, 1u + 4 + 4 + 4);
  parameters.colliders = {PlaneCollider{}, PlaneCollider{}};
  // 4 rounds over the particles, each with 2 colliders, and two more passes for each loop's end; one
  // for the loop around.
  EXPECT_EQ(CountResidentLoops(*model, parameters, 32).sweep, costs.sweep + 1 + 6 + 4 * 4);
}

// One strip of 99 links: along it four times, to 99 links or 100 particles, each with two passes more.
TEST(KernelCostsTest, SweepOfAChainAsAStrip) {
  const auto model = BuildModel(ChainDescription(100));
  ASSERT_EQ(model->strips().strip_count(), 1u);
  // The sweep's own pass, 1 + 2 of the phases, 1 + 2 of the strips in it.
  EXPECT_EQ(CountResidentLoops(*model, {}, 32).sweep, 1u + 3 + 3 + 2 * 101 + 2 * 102);
}

// 8 x 8 particles in 2 rounds of 32, 98 triangles in 4, at most 6 triangles per particle.
TEST(KernelCostsTest, AKickOfTheAir) {
  const auto model = GridModel(8, 8);
  ClothParameters parameters;
  const LoopCosts calm = CountResidentLoops(*model, parameters, 32);
  parameters.air_drag = 1;
  const LoopCosts windy = CountResidentLoops(*model, parameters, 32);
  EXPECT_EQ(windy.substep - calm.substep, (4 + 2) + (2 + 2) + 2 * (6 + 2));
  EXPECT_EQ(windy.fixed - calm.fixed, windy.substep - calm.substep);
  EXPECT_EQ(windy.sweep, calm.sweep);
}

TEST(KernelCostsTest, PartsCoverTheWholeStep) {
  const LoopCosts costs = {.sweep = 70, .substep = 130, .fixed = 200};
  StepSettings settings;
  for (const uint32_t substeps : {1u, 60u, 10'000u}) {
    for (const uint32_t iterations : {1u, 100u, 10'000u}) {
      settings.substeps = substeps;
      settings.max_iterations = iterations;
      const uint64_t parts = CountParts(costs, settings, 60'000);
      const uint64_t total = uint64_t{substeps} * (130 + uint64_t{iterations} * 70);
      EXPECT_GE(parts * 60'000, total + costs.fixed);
      EXPECT_EQ(parts == 1, total + costs.fixed <= 60'000);
    }
  }
  EXPECT_TRUE(CanRunInParts(costs, 800));
  EXPECT_FALSE(CanRunInParts(costs, 799));
}

}  // namespace
}  // namespace drape
