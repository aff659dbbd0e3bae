#include "server/solver/gl_compute/kernel_variant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/solver/gl_compute/kernel_costs.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr DeviceTraits kSoftware = {.is_software = true, .local_size = 0, .loop_budget = 60'000};
constexpr DeviceTraits kHardware = {.is_software = false, .local_size = 0, .loop_budget = 1u << 24};

KernelVariant VariantOf(const SceneModel& model, const ClothParameters& parameters,
                        const DeviceTraits& device = kHardware) {
  const Result<VariantChoice> choice = ChooseVariant(PlanOnDevice(model, parameters), device);
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
  EXPECT_EQ(VariantOf(*GridModel(8, 8), {}, kSoftware).local_size, 8u);
  EXPECT_EQ(VariantOf(*GridModel(16, 16), {}, kSoftware).local_size, 8u);
  EXPECT_EQ(VariantOf(*GridModel(64, 64), {}, kSoftware).local_size, 128u);
  EXPECT_EQ(VariantOf(*model, {}, kHardware).local_size, 1024u);
  EXPECT_EQ(VariantOf(*GridModel(8, 8), {}, kHardware).local_size, 64u);
  DeviceTraits chosen = kHardware;
  chosen.local_size = 16;
  EXPECT_EQ(VariantOf(*model, {}, chosen).local_size, 16u);
}

TEST(KernelVariantTest, LeavesOutWhatTheClothDoesNotHave) {
  const std::string bare = VariantOf(*GridModel(4, 4), test::PlainParameters()).Defines();
  for (const char* word :
       {"SPRING", "COMPLIANCE", "CONTACTS", "CAPSULES", "BOXES", "MAPS", "FRICTION", "RESTITUTION",
        "MOVING", "DAMPING", "PINS", "TOLERANCE", "REFINE", "LOOP_BUDGET"}) {
    EXPECT_THAT(bare, Not(HasSubstr(word)));
  }
  ModelDescription description = GridDescription(4, 4, {0});
  description.material.stretch_compliance_m_per_n = 1e-4;
  description.material.bending_stiffness_n_per_m = 1;
  ClothParameters parameters = test::PlainParameters();
  parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  parameters.friction_static = 0.3;
  parameters.restitution = 0.5;
  parameters.damping_per_s = 1;
  parameters.air_lift = 1;
  parameters.settings.tolerance = 1e-3;
  const auto model = BuildModel(description);
  const std::string full = VariantOf(*model, parameters).Defines();
  for (const char* word :
       {"HAS_APPLY_SPRINGS", "HAS_COMPLIANCE", "HAS_SOLVE_CONTACTS", "HAS_FRICTION",
        "HAS_RESTITUTION", "HAS_DAMPING", "HAS_PINS", "HAS_TOLERANCE", "HAS_APPLY_WIND"}) {
    EXPECT_THAT(full, HasSubstr(word));
  }
  EXPECT_THAT(full, Not(HasSubstr("MOVING")));
  ClothParameters moving = parameters;
  moving.collider_motions = {RigidMotion::AtRest(Eigen::Vector3d::Zero())};
  EXPECT_THAT(VariantOf(*model, moving).Defines(), HasSubstr("HAS_MOVING_COLLIDERS"));
  EXPECT_THAT(full, Not(HasSubstr("CAPSULE")));
  EXPECT_THAT(full, Not(HasSubstr("BOX")));
  EXPECT_THAT(full, Not(HasSubstr("CYLINDER")));
  EXPECT_THAT(full, Not(HasSubstr("MAP")));
  parameters.colliders = {{CapsuleShape{}}, {BoxShape{}}, {CylinderShape{}}};
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_CAPSULE\n"));
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_BOX\n"));
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_CYLINDER\n"));
  parameters.colliders = {{DistanceMapShape{}}};
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("#define HAS_DISTANCE_MAP\n"));
  parameters.settings.spring_integration = SpringIntegration::kInForce;
  EXPECT_THAT(VariantOf(*model, parameters).Defines(), HasSubstr("HAS_SPRING_FORCES"));
  EXPECT_THAT(full, Not(HasSubstr("ELASTIC")));
  description.material.bending_rigidity_n_m = 1e-4;
  EXPECT_THAT(VariantOf(*BuildModel(description), parameters).Defines(),
              HasSubstr("#define HAS_APPLY_ELASTIC\n"));
  parameters.colliders.clear();
  EXPECT_FALSE(VariantOf(*model, parameters).Has(Feature::kFriction))
      << "no friction without colliders";
  EXPECT_FALSE(VariantOf(*model, parameters).Has(Feature::kRestitution)) << "nothing to bounce off";
}

TEST(KernelVariantTest, RefinementOfStripsThatCrossOnly) {
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.refine_above_strain = 1e-3;
  const auto grid = GridModel(8, 8, {0});
  const KernelVariant variant = VariantOf(*grid, parameters);
  EXPECT_THAT(variant.Defines(), HasSubstr("#define HAS_REFINE\n"));
  EXPECT_EQ(variant.refine_local_size, 0u) << "of the tiled plan only";
  EXPECT_FALSE(VariantOf(*BuildModel(ChainDescription(64)), parameters).Has(StepStage::kRefine));
  ModelDescription soft = GridDescription(8, 8);
  soft.material.stretch_compliance_m_per_n = 1e-4;
  EXPECT_FALSE(VariantOf(*BuildModel(soft), parameters).Has(StepStage::kRefine));
  const auto driven = ChooseVariant(PlanOnDevice(*grid, parameters, LengthSource::kOwn), kHardware);
  EXPECT_FALSE(driven->variant.Has(StepStage::kRefine));
}

// One work group refines a tiled cloth: as large as the device's limit on loops requires.
TEST(KernelVariantTest, RefinementOfTiledCloths) {
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.refine_above_strain = 1e-3;
  const auto model = GridModel(64, 64);
  EXPECT_EQ(VariantOf(*model, parameters, kHardware).refine_local_size, 1024u);
  EXPECT_EQ(VariantOf(*model, parameters, kSoftware).refine_local_size, 32u);
  DeviceTraits chosen = kHardware;
  chosen.local_size = 16;
  EXPECT_EQ(VariantOf(*model, parameters, chosen).refine_local_size, 16u);
  chosen.refine_local_size = 64;
  EXPECT_EQ(VariantOf(*model, parameters, chosen).refine_local_size, 64u);
  EXPECT_EQ(VariantOf(*model, parameters, chosen).local_size, 16u);
  DeviceTraits device = kSoftware;
  device.loop_budget = 1000;
  const KernelVariant variant = VariantOf(*model, parameters, device);
  EXPECT_EQ(variant.refine_local_size, 64u);
  EXPECT_EQ(variant.local_size, 128u);
  EXPECT_LE(CountTiledRefineLoops(*model, 64), 1000u);
  EXPECT_GT(CountTiledRefineLoops(*model, 32), 1000u);
}

// Strips that fit the lanes, others from both ends; the local size that is set has no effect.
TEST(KernelVariantTest, ReductionOfStripsThatFitTheLanes) {
  DeviceTraits device = kHardware;
  device.strip_solve = StripSolve::kReduction;
  const auto solve_of = [&](const SceneModel& model,
                            const ClothParameters& parameters = test::PlainParameters()) {
    return VariantOf(model, parameters, device).strip_solve;
  };
  for (const uint32_t local_size : {0u, 8u, 1024u}) {
    device.local_size = local_size;
    EXPECT_EQ(solve_of(*GridModel(32, 32)), StripSolve::kReduction);
    EXPECT_EQ(solve_of(*BuildModel(ChainDescription(32))), StripSolve::kReduction);
    EXPECT_EQ(solve_of(*BuildModel(ChainDescription(33))), StripSolve::kFromBothEnds);
    EXPECT_EQ(solve_of(*GridModel(8, 8)), StripSolve::kReduction);
    EXPECT_EQ(solve_of(*GridModel(33, 33)), StripSolve::kFromBothEnds) << "tiled";
    EXPECT_GE(VariantOf(*GridModel(32, 32), {}, device).local_size, 32u);
  }
  ClothParameters colours = test::PlainParameters();
  colours.settings.sweep = Sweep::kColours;
  EXPECT_EQ(solve_of(*GridModel(32, 32), colours), StripSolve::kElimination);
  device.local_size = 0;
  const std::string defines = VariantOf(*GridModel(32, 32), {}, device).Defines();
  EXPECT_THAT(defines, testing::StartsWith("#extension GL_KHR_shader_subgroup_basic : require\n"));
  EXPECT_THAT(defines, HasSubstr("#define HAS_SUBGROUPS\n"));
  EXPECT_THAT(defines, HasSubstr("#define KEEPS_LANES\n")) << "one link of each phase";
  device.strip_solve = StripSolve::kReductionWithBarriers;
  EXPECT_EQ(solve_of(*GridModel(8, 8)), StripSolve::kReductionWithBarriers) << "wherever it can";
  const std::string with_barriers = VariantOf(*GridModel(32, 32), {}, device).Defines();
  EXPECT_THAT(with_barriers, HasSubstr("#define HAS_STRIP_REDUCTION\n"));
  EXPECT_THAT(with_barriers, Not(HasSubstr("SUBGROUP")));
  EXPECT_THAT(VariantOf(*GridModel(32, 32), {}, kHardware).Defines(), Not(HasSubstr("REDUCTION")));
}

// `measure` has work groups of its own: how few invocations step a cloth does not limit colliders.
TEST(KernelVariantTest, SmallWorkGroupsRefuseNoColliders) {
  ClothParameters parameters = test::PlainParameters();
  parameters.colliders.assign(300, PlaneThrough({0, 0, 0}, {0, 1, 0}));
  const auto model = GridModel(8, 8);
  EXPECT_EQ(VariantOf(*model, parameters, kSoftware).local_size, 8u);
  DeviceTraits chosen = kSoftware;
  chosen.local_size = 8;
  EXPECT_FALSE(ChooseVariant(PlanOnDevice(*model, parameters), chosen).ok());
}

TEST(KernelVariantTest, LongStepsRunInPartsOnSoftwareOnly) {
  const auto model = GridModel(32, 32);
  ClothParameters parameters = test::PlainParameters();
  parameters.settings = PresetSettings(Preset::kAccurate);
  EXPECT_FALSE(VariantOf(*model, parameters, kHardware).is_in_parts());
  const Result<VariantChoice> choice = ChooseVariant(PlanOnDevice(*model, parameters), kSoftware);
  ASSERT_TRUE(choice.ok());
  EXPECT_TRUE(choice->variant.is_in_parts());
  EXPECT_GT(choice->part_count, 1u);
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime}) {
    parameters.settings = PresetSettings(preset);
    EXPECT_FALSE(VariantOf(*model, parameters, kSoftware).is_in_parts());
  }
}

}  // namespace
}  // namespace drape
