#include "server/solver/gl_compute/gl_cloth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <string>

#include "server/scene/distance_map.h"
#include "server/solver/gl_compute/packing.h"
#include "shaders/interface/bindings.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"
#include "tests/support/solids/solids.h"

namespace drape {
namespace {

using testing::ElementsAre;

float AsFloat(uint32_t word) {
  return std::bit_cast<float>(word);
}

TEST(PackModelTest, ResidentModelsPackPairsIntoOneWord) {
  const auto model = BuildModel(ChainDescription(3, {2}));
  const PackedModel packed = PackModel(*model);
  const shader::ModelLayout& layout = packed.layout;
  const DistanceConstraint& first = model->constraints()[0];
  EXPECT_EQ(packed.words[layout.pairs], first.i | first.j << 16);
  EXPECT_EQ(AsFloat(packed.words[layout.rest_lengths]), 0.02f);
  EXPECT_EQ(packed.words[layout.colour_offsets + model->colour_count()], 2u);
  EXPECT_EQ(AsFloat(packed.words[layout.masses + 2]), 0.01f);
  EXPECT_EQ(AsFloat(packed.words[layout.inverse_masses]), 100.0f);
  EXPECT_EQ(AsFloat(packed.words[layout.inverse_masses + 2]), 0.0f);
  EXPECT_EQ(packed.words[layout.pins], 2u);
}

TEST(PackModelTest, TiledModelsHaveTwoWordsPerPair) {
  const auto model = BuildModel(ChainDescription(70'000));
  const PackedModel packed = PackModel(*model);
  for (const uint32_t k : {0u, 50'000u, 69'998u}) {
    EXPECT_EQ(packed.words[packed.layout.pairs + 2 * k], model->constraints()[k].i);
    EXPECT_EQ(packed.words[packed.layout.pairs + 2 * k + 1], model->constraints()[k].j);
  }
}

TEST(PackModelTest, TrianglesArePackedForClothsInTheAirOnly) {
  const auto model = GridModel(2, 2);  // triangles 0 2 1 and 1 2 3
  EXPECT_EQ(PackModel(*model).layout.triangles, 0u);
  const PackedModel packed = PackModel(*model, {.has_air_forces = true});
  const auto words = [&](uint32_t begin, size_t count) {
    return std::vector(packed.words.begin() + begin, packed.words.begin() + begin + count);
  };
  EXPECT_THAT(words(packed.layout.triangles, 6), ElementsAre(0, 2, 1, 1, 2, 3));
  EXPECT_THAT(words(packed.layout.triangle_offsets, 5), ElementsAre(0, 1, 3, 5, 6));
  EXPECT_THAT(words(packed.layout.particle_triangles, 6), ElementsAre(0, 0, 1, 0, 1, 1));
  EXPECT_EQ(AsFloat(packed.words[packed.layout.corner_shares + 1]),
            static_cast<float>(model->corner_shares()[1]));
  EXPECT_EQ(AsFloat(packed.words[packed.layout.triangle_masses]),
            static_cast<float>(model->triangle_masses_kg()[0]));
}

PackedLayout<shader::ScratchLayout> ScratchOf(const SceneModel& model,
                                              const ClothParameters& parameters,
                                              bool has_work_state) {
  return LayOutScratch(PlanOnDevice(model, parameters), has_work_state);
}

TEST(LayOutScratchTest, ArraysDoNotOverlap) {
  ModelDescription description = GridDescription(10, 10);
  description.material.stretch_compliance_m_per_n = 1e-4;
  description.material.shear_stiffness_n_per_m = 1;
  const auto model = BuildModel(description);
  ClothParameters parameters = test::PlainParameters();
  parameters.colliders.assign(3, PlaneThrough({0, 0, 0}, {0, 1, 0}));
  parameters.friction_static = 0.1;
  parameters.air_drag = 1;
  parameters.settings.twist_damping_per_s = 1;
  const auto [layout, size] = ScratchOf(*model, parameters, true);
  EXPECT_EQ(layout.lambdas, 0u);
  EXPECT_EQ(layout.normal_betas, layout.lambdas + model->constraint_count());
  EXPECT_EQ(layout.tangent_betas, layout.normal_betas + 300);
  EXPECT_EQ(layout.slidings, layout.tangent_betas + 900);  // the dynamic friction is less
  EXPECT_EQ(layout.violations, layout.slidings + 300);
  EXPECT_EQ(layout.met_colliders, layout.violations + 100);
  EXPECT_EQ(layout.spring_accelerations, layout.met_colliders + 100);
  EXPECT_EQ(layout.air_impulses, layout.spring_accelerations + 300);
  EXPECT_EQ(layout.previous_positions, layout.air_impulses + 3 * 162);
  EXPECT_EQ(layout.previous_velocities, layout.previous_positions + 300);
  EXPECT_EQ(layout.twist_changes, layout.previous_velocities + 300);
  EXPECT_EQ(layout.strip_links, layout.twist_changes + 300);
  EXPECT_EQ(layout.work_positions, layout.strip_links + 5 * uint64_t{model->constraint_count()});
  EXPECT_EQ(layout.work_velocities, layout.work_positions + 300);
  EXPECT_EQ(layout.quiet_flags, layout.work_velocities + 300);
  EXPECT_EQ(layout.start_positions, layout.quiet_flags + 100);
  EXPECT_EQ(size, layout.start_positions + 300);
  ClothParameters plain = test::PlainParameters();
  plain.settings.sweep = Sweep::kColours;
  EXPECT_EQ(ScratchOf(*GridModel(10, 10), plain, false).size, 300u)
      << "where a measured step began; nothing that is not needed";
  plain.settings.sweep = Sweep::kStrips;
  EXPECT_EQ(ScratchOf(*GridModel(10, 10), plain, false).size, 300u + 600u + 5 * 180)
      << "the state before, and the links, too";
}

// Flags, whether there are any, a count for each colour and for all, a list of all constraints.
TEST(LayOutScratchTest, RefinementOfTiledCloths) {
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.direction = Direction::kAtEnd;
  const auto resident = GridModel(10, 10);
  const auto tiled = GridModel(41, 25);
  const uint64_t resident_size = ScratchOf(*resident, parameters, false).size;
  const uint64_t tiled_size = ScratchOf(*tiled, parameters, true).size;
  parameters.settings.refine_above_strain = 1e-3;
  EXPECT_EQ(ScratchOf(*resident, parameters, false).size, resident_size);
  const auto [layout, size] = ScratchOf(*tiled, parameters, true);
  const uint64_t flags = 1025 + 2 + uint64_t{tiled->colour_count()};
  EXPECT_EQ(layout.refined_links, layout.stretched_flags + flags);
  EXPECT_EQ(layout.work_positions, layout.refined_links + tiled->constraint_count());
  EXPECT_EQ(size, tiled_size + flags + tiled->constraint_count());
}

TEST(MeasurePieceCountTest, CountsTheLongerOfParticlesAndConstraints) {
  EXPECT_EQ(MeasurePieceCount(*GridModel(32, 32)), 1u);  // 1984 constraints
  EXPECT_EQ(MeasurePieceCount(*BuildModel(ChainDescription(2049))), 2u);
  EXPECT_EQ(MeasurePieceCount(*GridModel(40, 40)), 2u);  // 3120 constraints
}

uint32_t WordOf(ShapeKind kind) {
  return static_cast<uint32_t>(kind);
}

TEST(PackCollidersTest, EveryShape) {
  const std::vector<Collider> colliders = {
      SphereAt({1, 2, 3}, 0.5), PlaneThrough({4, 5, 6}, {0, 0, 1}),
      CapsuleBetween({1, 2, 3}, {3, 2, 3}, 0.25),
      BoxAt({7, 8, 9}, {0.5, 1, 2}, Eigen::Quaterniond(0, 0, 0, 1)),  // half a turn about z
      CylinderBetween({1, 2, 3}, {1, 2, 7}, 0.5)};
  const std::vector<uint32_t> words = PackColliders(colliders);
  ASSERT_EQ(words.size(), 5u * DRAPE_COLLIDER_WORDS);
  EXPECT_EQ(words[0], WordOf(ShapeKind::kSphere));
  EXPECT_EQ(AsFloat(words[1]), 0.5f);
  EXPECT_EQ(AsFloat(words[4]), 3.0f);
  const auto floats = [&words](size_t collider, size_t first, size_t count) {
    std::vector<float> values;
    for (size_t k = 0; k < count; ++k) {
      values.push_back(AsFloat(words[collider * DRAPE_COLLIDER_WORDS + first + k]));
    }
    return values;
  };
  EXPECT_EQ(words[DRAPE_COLLIDER_WORDS], WordOf(ShapeKind::kPlane));
  EXPECT_THAT(floats(1, 2, 6), ElementsAre(0, 0, 6, 0, 0, 1));
  EXPECT_EQ(words[2 * DRAPE_COLLIDER_WORDS], WordOf(ShapeKind::kCapsule));
  EXPECT_THAT(floats(2, 1, 10), ElementsAre(0.25f, 1, 2, 3, 2, 0, 0, 0, 1, 0));
  EXPECT_EQ(words[3 * DRAPE_COLLIDER_WORDS], WordOf(ShapeKind::kBox));
  EXPECT_THAT(floats(3, 2, 15), ElementsAre(7, 8, 9, 0.5f, 1, 2, -1, 0, 0, 0, -1, 0, 0, 0, 1));
  EXPECT_EQ(words[4 * DRAPE_COLLIDER_WORDS], WordOf(ShapeKind::kCylinder));
  EXPECT_THAT(floats(4, 1, 13), ElementsAre(0.5f, 1, 2, 5, 0.5f, 2, 0, 0, 0, 1, 0, 1, 0));
}

TEST(PackCollidersTest, DistanceMapsInTheirOrder) {
  const auto map =
      DistanceMap::Build(test::BoxMesh({1, 2, 3}, {2, 3, 4}), {.resolution = 4}).value();
  const Eigen::Quaterniond half_turn(0, 0, 0, 1);  // about z
  const std::vector<Collider> colliders = {
      SphereAt({0, 0, 0}, 1), DistanceMapAt(map, {{10, 20, 30}, half_turn}), DistanceMapAt(map)};
  FreeList list(1000);
  ASSERT_EQ(list.Allocate(64), 0u);
  std::vector<std::shared_ptr<const DeviceMap>> maps;
  for (int k = 0; k < 2; ++k) {
    auto on_device = std::make_shared<DeviceMap>();
    on_device->words = WordRange(&list, *list.Allocate(64), 64, 64);
    maps.push_back(on_device);
  }
  const std::vector<uint32_t> words = PackColliders(colliders, maps);
  ASSERT_EQ(words.size(), 3u * DRAPE_COLLIDER_WORDS);
  const uint32_t first = DRAPE_COLLIDER_WORDS;
  EXPECT_EQ(words[first - 1], 0u) << "no map";
  EXPECT_EQ(words[first], WordOf(ShapeKind::kDistanceMap));
  EXPECT_EQ(words[first + 17], 64u);
  EXPECT_EQ(words[2 * first + 17], 128u);
  // 3 cells of 1/4 m below the mesh's corner, turned.
  EXPECT_EQ(AsFloat(words[first + 2]), 10 - 0.25f);
  EXPECT_EQ(AsFloat(words[first + 3]), 20 - 1.25f);
  EXPECT_EQ(AsFloat(words[first + 4]), 30 + 2.25f);
  EXPECT_EQ(AsFloat(words[first + 8]), -1.0f);
  EXPECT_EQ(AsFloat(words[2 * first + 2]), 0.25f);
}

TEST(PackStateTest, PositionsThenVelocities) {
  const ParticleState state{.positions_m = {{1, 2, 3}, {4, 5, 6}},
                            .velocities_m_per_s = {{7, 8, 9}, {10, 11, 12}}};
  EXPECT_THAT(PackState(state), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
}

shader::ClothRecord RecordOf(const std::shared_ptr<const SceneModel>& model,
                             const ClothParameters& parameters) {
  StepKernels kernels;
  kernels.variant.capacity = 256;
  GlCloth cloth{{.plan = PlanOnDevice(*model, parameters).plan, .kernels = &kernels}};
  cloth.model = std::make_shared<DeviceModel>(DeviceModel{.model = model});
  cloth.parameters = parameters;
  return MakeClothRecord(cloth);
}

TEST(MakeClothRecordTest, SettingsInTheUnitsOfTheKernels) {
  const auto model = GridModel(11, 11, {0});  // length scale 0.1 m
  ClothParameters parameters = test::PlainParameters();
  parameters.damping_per_s = 3;
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.tolerance = 0.01;
  parameters.settings.time_step_s = 0.02;
  parameters.settings.substeps = 4;
  EXPECT_EQ(RecordOf(model, parameters).triangle_count, 0u) << "none needed without drag and lift";
  parameters.wind_m_per_s = {1, 2, 3};
  parameters.air_drag = 2;
  const shader::ClothRecord record = RecordOf(model, parameters);
  const shader::StepNumbers& step = record.step;
  EXPECT_EQ(record.triangle_count, 200u);
  EXPECT_FLOAT_EQ(step.wind.z, 3);
  EXPECT_FLOAT_EQ(step.air_drag, 1.225f / 2);
  EXPECT_EQ(step.air_lift, 0);
  EXPECT_EQ(record.particle_count, 121u);
  EXPECT_EQ(record.pin_count, 1u);
  EXPECT_EQ(step.substeps, 4u);
  EXPECT_FLOAT_EQ(step.h, 0.005f);
  EXPECT_FLOAT_EQ(step.inverse_h, 200);
  EXPECT_FLOAT_EQ(step.gravity.y, -9.81f);
  EXPECT_FLOAT_EQ(step.contact_tolerance, 0.001f);
  EXPECT_FLOAT_EQ(step.max_depenetration, 0.005f);  // 1 m/s
  EXPECT_FLOAT_EQ(record.substeps[0].damping_factor, static_cast<float>(std::exp(-0.015)));
  EXPECT_FLOAT_EQ(record.substeps[0].kick_before, 0.0025f);
  EXPECT_FLOAT_EQ(record.substeps[DRAPE_SUBSTEP_LAST].inverse_interval, 200);
  EXPECT_FLOAT_EQ(step.contact_margin, 1e-4f);
  EXPECT_EQ(record.is_tiled, 0u);
}

TEST(MakeClothRecordTest, RefinementNotBelowTheToleranceThatIsUsed) {
  const auto model = GridModel(11, 11);
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.refine_above_strain = 0;
  EXPECT_EQ(RecordOf(model, parameters).step.refine_rounds, 0u);
  parameters.settings.refine_above_strain = 0.25;
  const shader::StepNumbers step = RecordOf(model, parameters).step;
  EXPECT_EQ(step.refine_rounds, 16u);
  EXPECT_EQ(step.shortest_sq, 0.5625f);
  EXPECT_EQ(step.longest_sq, 1.5625f);
  parameters.settings.tolerance = 0.5;
  EXPECT_EQ(RecordOf(model, parameters).step.shortest_sq, 0.25f);
  EXPECT_EQ(RecordOf(model, parameters).step.longest_sq, 2.25f);
}

// The record of each substep's kind agrees with the schedule.
TEST(MakeClothRecordTest, SubstepsAreThoseOfTheSchedule) {
  const auto model = GridModel(8, 8, {0});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.twist_damping_per_s = 20;
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    parameters.settings.integration = integration;
    for (uint32_t substeps = 1; substeps < 40; ++substeps) {
      parameters.settings.substeps = substeps;
      const SubstepSchedule schedule = PlanOnDevice(*model, parameters).plan.schedule;
      const shader::ClothRecord record = RecordOf(model, parameters);
      ASSERT_EQ(record.step.substeps, schedule.size());
      for (uint32_t index = 0; index < schedule.size(); ++index) {
        SCOPED_TRACE(std::to_string(index) + " of " + std::to_string(substeps));
        const Substep expected = schedule[index];
        const shader::SubstepRecord& substep =
            record.substeps[shader::SubstepKindOf(index, schedule.size())];
        EXPECT_EQ(substep.interval, static_cast<float>(expected.interval_s));
        EXPECT_EQ(substep.inverse_interval, static_cast<float>(1 / expected.interval_s));
        EXPECT_EQ(substep.link_interval, static_cast<float>(expected.link_interval_s));
        EXPECT_EQ(substep.inverse_link_interval, static_cast<float>(1 / expected.link_interval_s));
        EXPECT_EQ(substep.inverse_duration, static_cast<float>(1 / expected.duration_s));
        EXPECT_EQ(substep.pin_end - index, expected.pin_shares);
        EXPECT_EQ(substep.pin_lead,
                  static_cast<float>(1 - expected.interval_s / expected.duration_s));
        EXPECT_EQ(substep.kick_before, static_cast<float>(expected.kick_before_s));
        EXPECT_EQ(substep.kick_within, static_cast<float>(expected.kick_within_s));
        EXPECT_EQ(substep.kick_after, static_cast<float>(expected.kick_after_s));
        EXPECT_EQ(substep.twist_share, static_cast<float>(expected.twist_share));
        EXPECT_EQ(substep.lead, static_cast<float>(expected.lead_s));
      }
    }
  }
}

TEST(PlacedTest, EveryOffsetFromTheStartOfTheBlock) {
  const shader::ParameterLayout placed = Placed(shader::ParameterLayout{.pin_targets = 0,
                                                                        .held = 3,
                                                                        .inverse_masses = 3,
                                                                        .colliders = 3,
                                                                        .collider_motions = 5,
                                                                        .length_starts = 5,
                                                                        .length_targets = 9,
                                                                        .elastic_entries = 12,
                                                                        .hinge_stages = 13},
                                                100);
  EXPECT_EQ(placed.pin_targets, 100u);
  EXPECT_EQ(placed.colliders, 103u);
  EXPECT_EQ(placed.length_targets, 109u);
  EXPECT_EQ(placed.elastic_entries, 112u);
}

}  // namespace
}  // namespace drape
