#include "server/scene/scene_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <type_traits>

#include "server/scene/colouring.h"

namespace drape {
namespace {

ModelDescription GridDescription(uint32_t columns, uint32_t rows) {
  ModelDescription description;
  description.topology =
      GridTopology{.columns = columns, .rows = rows, .width_m = 1, .height_m = 2};
  description.material = {
      .areal_density_kg_per_m2 = 0.2, .bending_stiffness_n_per_m = 1, .shear_stiffness_n_per_m = 2};
  return description;
}

std::shared_ptr<const SceneModel> MustBuild(const ModelDescription& description) {
  auto result = SceneModel::Build(description);
  EXPECT_TRUE(result.ok()) << result.status().ToString();
  return result.value();
}

TEST(SceneModel, ConstraintsAreSortedByColourStably) {
  const auto model = MustBuild(GridDescription(7, 5));
  const ParticleSystem system =
      BuildGrid({.columns = 7, .rows = 5, .width_m = 1, .height_m = 2}, {});
  const auto colours = ColourConstraints(system.distance_constraints, 35);
  ASSERT_EQ(model->colour_offsets().front(), 0u);
  ASSERT_EQ(model->colour_offsets().back(), model->constraint_count());
  std::vector<std::pair<uint32_t, uint32_t>> expected;
  for (uint32_t colour = 0; colour < model->colour_count(); ++colour) {
    EXPECT_EQ(model->colour_offsets()[colour], expected.size());
    for (size_t k = 0; k < colours.size(); ++k) {
      if (colours[k] != colour) continue;
      expected.emplace_back(system.distance_constraints[k].i, system.distance_constraints[k].j);
    }
  }
  std::vector<std::pair<uint32_t, uint32_t>> sorted;
  for (const auto& constraint : model->constraints())
    sorted.emplace_back(constraint.i, constraint.j);
  EXPECT_EQ(sorted, expected);
}

// Every constraint knows its place in the description, in which those between pins count.
TEST(SceneModel, ConstraintsKnowTheirSources) {
  ModelDescription description = GridDescription(5, 4);
  description.pinned_particles = {0, 1, 7};
  const auto model = MustBuild(description);
  const ParticleSystem system =
      BuildGrid({.columns = 5, .rows = 4, .width_m = 1, .height_m = 2}, {});
  EXPECT_EQ(model->described_constraint_count(), system.distance_constraints.size());
  EXPECT_EQ(model->constraint_count(), system.distance_constraints.size() - 1);
  ASSERT_EQ(model->constraint_sources().size(), model->constraint_count());
  for (uint32_t k = 0; k < model->constraint_count(); ++k) {
    const auto& source = system.distance_constraints.at(model->constraint_sources()[k]);
    EXPECT_EQ(model->constraints()[k].i, source.i);
    EXPECT_EQ(model->constraints()[k].j, source.j);
  }
}

// As in the protocol (RestLengthControls.constraints).
TEST(SceneModel, AGridCountsItsEdgesAlongRowsThenAlongColumns) {
  const GridTopology grid{.columns = 5, .rows = 4, .width_m = 1, .height_m = 2};
  const ParticleSystem system = BuildGrid(grid, {});
  for (uint32_t row = 0; row < 4; ++row) {
    for (uint32_t column = 0; column < 5; ++column) {
      const uint32_t particle = row * 5 + column;
      if (column < 4) {
        EXPECT_EQ(system.distance_constraints[row * 4 + column].i, particle);
        EXPECT_EQ(system.distance_constraints[row * 4 + column].j, particle + 1);
      }
      if (row < 3) {
        EXPECT_EQ(system.distance_constraints[4 * 4 + particle].i, particle);
        EXPECT_EQ(system.distance_constraints[4 * 4 + particle].j, particle + 5);
      }
    }
  }
}

TEST(SceneModel, JointsHaveColoursOfTheirOwn) {
  ParticleTopology particles;
  for (uint32_t i = 0; i < 5; ++i) {
    particles.positions_m.emplace_back(i, 0, 0);
    particles.masses_kg.push_back(1);
  }
  particles.distance_constraints = {{0, 1, 1, 0}};
  // The last one joins two pins.
  particles.point_joints = {{0, 1, 0}, {1, 2, 1e-3}, {2, 3, 0}, {3, 4, 0}};
  const auto model = MustBuild({particles, {}, {3, 4}});
  EXPECT_EQ(model->colour_count(), 1u);
  ASSERT_EQ(model->joint_colour_count(), 2u);
  EXPECT_EQ(model->joint_count(), 3u);
  EXPECT_EQ(model->dropped_constraints(), 1u);
  EXPECT_TRUE(model->has_joint_compliance());
  EXPECT_FALSE(model->has_compliance() || model->has_inequalities());
  const auto offsets = model->joint_colour_offsets();
  EXPECT_EQ(std::vector<uint32_t>(offsets.begin(), offsets.end()),
            (std::vector<uint32_t>{0, 2, 3}));
  EXPECT_EQ(model->joints()[1].i, 2u);
  EXPECT_EQ(model->joints()[2].i, 1u);
}

TEST(SceneModel, EveryParticleSeesItsSpringsInOrder) {
  const auto model = MustBuild(GridDescription(4, 3));
  ASSERT_EQ(model->spring_ends().size(), 2 * model->spring_count());
  for (uint32_t p = 0; p < model->particle_count(); ++p) {
    std::vector<uint32_t> expected;
    for (const Spring& spring : model->springs()) {
      if (spring.i == p) expected.push_back(spring.j);
      if (spring.j == p) expected.push_back(spring.i);
    }
    std::vector<uint32_t> seen;
    for (uint32_t k = model->spring_offsets()[p]; k < model->spring_offsets()[p + 1]; ++k) {
      seen.push_back(model->spring_ends()[k].other_particle);
    }
    EXPECT_EQ(seen, expected) << "particle " << p;
  }
}

TEST(SceneModel, PinsAreSortedAndHaveNoInverseMass) {
  ModelDescription description = GridDescription(4, 3);
  description.pinned_particles = {9, 0, 3};
  const auto model = MustBuild(description);
  EXPECT_EQ(std::vector<uint32_t>(model->pins().begin(), model->pins().end()),
            (std::vector<uint32_t>{0, 3, 9}));
  for (uint32_t p = 0; p < 12; ++p) {
    const bool is_pin = p == 0 || p == 3 || p == 9;
    EXPECT_EQ(model->inverse_masses_per_kg()[p], is_pin ? 0 : 1 / model->masses_kg()[p]);
    EXPECT_GT(model->masses_kg()[p], 0);
  }
}

TEST(SceneModel, ConstraintsAndSpringsBetweenPinsAreLeftOut) {
  ModelDescription description = GridDescription(5, 2);
  const auto free_model = MustBuild(description);
  description.pinned_particles = {0, 1, 2, 3, 4};
  const auto model = MustBuild(description);
  EXPECT_EQ(model->dropped_constraints(), 4u);
  EXPECT_EQ(model->constraint_count(), free_model->constraint_count() - 4);
  EXPECT_EQ(model->spring_count(), free_model->spring_count() - 3)
      << "bending along the pinned row";
  for (const auto& constraint : model->constraints()) {
    EXPECT_TRUE(constraint.i > 4 || constraint.j > 4);
  }
  EXPECT_EQ(free_model->dropped_constraints(), 0u);
}

TEST(SceneModel, AllParticlesPinnedIsLegalAndEmpty) {
  ModelDescription description = GridDescription(2, 2);
  description.pinned_particles = {0, 1, 2, 3};
  const auto model = MustBuild(description);
  EXPECT_EQ(model->constraint_count(), 0u);
  EXPECT_EQ(model->colour_count(), 0u);
  EXPECT_EQ(model->length_scale_m(), 1);
}

TEST(SceneModel, LengthScaleIsTheMeanOfConstraintsElseOfSprings) {
  ParticleTopology particles;
  particles.positions_m = {{0, 0, 0}, {1, 0, 0}, {4, 0, 0}};
  particles.masses_kg = {1, 1, 1};
  particles.springs = {{.i = 0, .j = 1, .rest_length_m = 0.5, .stiffness_n_per_m = 1},
                       {.i = 1, .j = 2, .rest_length_m = 1.5, .stiffness_n_per_m = 1}};
  EXPECT_EQ(
      MustBuild({.topology = particles, .material = {}, .pinned_particles = {}})->length_scale_m(),
      1);
  particles.distance_constraints = {{.i = 0, .j = 1, .rest_length_m = 1},
                                    {.i = 1, .j = 2, .rest_length_m = 3}};
  EXPECT_EQ(
      MustBuild({.topology = particles, .material = {}, .pinned_particles = {}})->length_scale_m(),
      2);
}

TEST(SceneModel, MeanSoftnessIsTheMeanStrainPerForce) {
  ParticleTopology particles;
  particles.positions_m = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}};
  particles.masses_kg = {1, 1, 1};
  particles.distance_constraints = {
      {.i = 0, .j = 1, .rest_length_m = 1, .compliance_m_per_n = 0.25},
      {.i = 1, .j = 2, .rest_length_m = 2, .compliance_m_per_n = 1.5}};
  const ModelDescription description{.topology = particles, .material = {}, .pinned_particles = {}};
  EXPECT_EQ(MustBuild(description)->mean_softness_per_n(), 0.5);  // of 0.25 and 0.75
}

double FrequencyBound(double mass_0_kg, double mass_1_kg, std::vector<uint32_t> pins = {}) {
  ParticleTopology pair;
  pair.positions_m = {{0, 0, 0}, {1, 0, 0}};
  pair.masses_kg = {mass_0_kg, mass_1_kg};
  pair.springs = {{0, 1, 1, 8, 0}};
  return MustBuild({.topology = pair, .material = {}, .pinned_particles = std::move(pins)})
      ->spring_frequency_sq_bound();
}

// Two masses on a spring k oscillate with omega^2 = k (1/m_0 + 1/m_1).
TEST(SceneModel, SpringFrequencyBoundIsReachedByAPair) {
  EXPECT_DOUBLE_EQ(FrequencyBound(0.5, 0.5), 8 * (2.0 + 2.0));
  EXPECT_DOUBLE_EQ(FrequencyBound(0.5, 0.5, {0}), 8 * 2.0);
  EXPECT_GE(FrequencyBound(0.5, 50), 8 * (2.0 + 0.02));
  EXPECT_LE(FrequencyBound(0.5, 50), 8 * (2.0 + 2.0)) << "no worse than the lighter mass twice";
  EXPECT_EQ(
      MustBuild({.topology = GridTopology{2, 2, 1, 1}, .material = {}, .pinned_particles = {}})
          ->spring_frequency_sq_bound(),
      0);
}

// A particle in the middle of four others, and the mass of each.
double HeldRatio(double middle_kg, std::vector<double> around_kg, std::vector<uint32_t> pins = {},
                 double compliance_m_per_n = 0) {
  ParticleTopology star;
  star.positions_m = {{0, 0, 0}};
  star.masses_kg = {middle_kg};
  for (uint32_t k = 0; k < around_kg.size(); ++k) {
    star.positions_m.emplace_back(std::cos(k), std::sin(k), 0);
    star.masses_kg.push_back(around_kg[k]);
    star.distance_constraints.push_back({0, k + 1, 1, compliance_m_per_n});
  }
  return MustBuild({.topology = star, .material = {}, .pinned_particles = std::move(pins)})
      ->held_mass_ratio();
}

TEST(SceneModel, HeldMassRatioIsThatOfTheFourthHeaviestNeighbour) {
  EXPECT_EQ(HeldRatio(1, {7, 7, 7}), 0) << "three leave it a way";
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80}), 15);
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80, 1}), 15);
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80, 1, 40}), 20);
  EXPECT_EQ(HeldRatio(2, {1, 60, 30, 80}, {1}), 15) << "a pin is heavier than all";
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80}, {0}), 0) << "a pin is not held";
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80, 40}, {2}, 1e-3), 15) << "nor holds one by a soft link";
  EXPECT_EQ(HeldRatio(2, {100, 60, 30, 80}, {1, 2, 3, 4}, 1e-3), 0) << "nor do four";
  const auto grid =
      MustBuild({.topology = GridTopology{5, 5, 1, 1}, .material = {}, .pinned_particles = {}});
  EXPECT_EQ(grid->held_mass_ratio(), 1);
}

TEST(SceneModel, LeastSpringDampingIsOfTheLeastDampedStiffSpring) {
  ParticleTopology chain;
  chain.positions_m = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  chain.masses_kg = {1, 1, 1};
  EXPECT_EQ(MustBuild({.topology = chain, .material = {}, .pinned_particles = {}})
                ->least_spring_damping_s(),
            0);
  chain.springs = {{0, 1, 1, 8, 2}, {1, 2, 1, 4, 0.5}, {0, 2, 1, 0, 3}};
  EXPECT_EQ(MustBuild({.topology = chain, .material = {}, .pinned_particles = {}})
                ->least_spring_damping_s(),
            0.125);
}

TEST(SceneModel, ResolutionRatioIsExtentOverShortestEdge) {
  ModelDescription description;
  description.topology = GridTopology{.columns = 5, .rows = 3, .width_m = 1, .height_m = 2};
  EXPECT_DOUBLE_EQ(MustBuild(description)->resolution_ratio(), 2 / 0.25);
}

TEST(SceneModel, TwoConstraintsBetweenTheSamePairGetTwoColours) {
  ParticleTopology particles;
  particles.positions_m = {{0, 0, 0}, {1, 0, 0}};
  particles.masses_kg = {1, 1};
  particles.distance_constraints = {{.i = 0, .j = 1, .rest_length_m = 1},
                                    {.i = 1, .j = 0, .rest_length_m = 1, .compliance_m_per_n = 1}};
  const auto model = MustBuild({.topology = particles, .material = {}, .pinned_particles = {}});
  EXPECT_EQ(model->colour_count(), 2u);
  EXPECT_TRUE(model->has_compliance());
}

TEST(SceneModel, IsSharedAndCannotBeChanged) {
  static_assert(!std::is_default_constructible_v<SceneModel>);
  static_assert(std::is_same_v<decltype(SceneModel::Build({}, {}).value()),
                               std::shared_ptr<const SceneModel>&&>);
  const auto model = MustBuild(GridDescription(3, 3));
  const auto other_owner = model;
  EXPECT_EQ(model.use_count(), 2);
  EXPECT_TRUE((std::is_const_v<std::remove_reference_t<decltype(model->constraints()[0])>>));
  EXPECT_TRUE((std::is_const_v<std::remove_reference_t<decltype(model->masses_kg()[0])>>));
}

// Every kind of content must reach the hash and the comparison.
TEST(SceneModel, EqualContentHasEqualHashesAndAnyDifferenceShows) {
  ParticleTopology base;
  base.positions_m = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  base.masses_kg = {1, 2, 3};
  base.distance_constraints = {{.i = 0, .j = 1, .rest_length_m = 1},
                               {.i = 1, .j = 2, .rest_length_m = 1}};
  base.springs = {{.i = 0, .j = 2, .rest_length_m = 2, .stiffness_n_per_m = 5}};
  const auto build = [](const ParticleTopology& topology, std::vector<uint32_t> pins) {
    return MustBuild({.topology = topology, .material = {}, .pinned_particles = std::move(pins)});
  };
  const auto model = build(base, {0});
  const auto twin = build(base, {0});
  EXPECT_EQ(model->content_hash(), twin->content_hash());
  EXPECT_TRUE(model->SameContent(*twin));

  std::vector<std::shared_ptr<const SceneModel>> others = {build(base, {}), build(base, {1}),
                                                           build(base, {0, 1})};
  const auto add_changed = [&](auto change) {
    ParticleTopology changed = base;
    change(changed);
    others.push_back(build(changed, {0}));
  };
  add_changed([](auto& t) { t.positions_m[2].z() = 1e-12; });
  add_changed([](auto& t) { t.masses_kg[0] = 1.5; });  // a pin's mass counts in energies
  add_changed([](auto& t) { t.distance_constraints[1].rest_length_m = 1.25; });
  add_changed([](auto& t) { t.distance_constraints[1].compliance_m_per_n = 1e-9; });
  add_changed([](auto& t) { std::swap(t.distance_constraints[0], t.distance_constraints[1]); });
  add_changed([](auto& t) { t.distance_constraints.pop_back(); });
  add_changed([](auto& t) { t.distance_constraints[1].kind = ConstraintKind::kAtMost; });
  add_changed([](auto& t) { t.point_joints = {{0, 2, 0}}; });
  add_changed([](auto& t) { t.point_joints = {{1, 2, 0}}; });
  add_changed([](auto& t) { t.point_joints = {{1, 2, 1e-9}}; });
  add_changed([](auto& t) { t.springs[0].damping_n_s_per_m = 1; });
  add_changed([](auto& t) { t.springs[0].stiffness_n_per_m = 6; });
  add_changed([](auto& t) { t.springs[0].rest_length_m = 1; });
  add_changed([](auto& t) { t.springs.clear(); });
  for (size_t k = 0; k < others.size(); ++k) {
    EXPECT_FALSE(model->SameContent(*others[k])) << k;
    EXPECT_NE(model->content_hash(), others[k]->content_hash()) << k;
  }
}

TEST(SceneModel, ElasticElementsAreContent) {
  ModelDescription description;
  description.topology = GridTopology{.columns = 4, .rows = 3, .width_m = 1, .height_m = 1};
  const auto plain = MustBuild(description);
  description.material.bending_rigidity_n_m = 1e-4;
  const auto bent = MustBuild(description);
  description.material.bending_rigidity_n_m = 2e-4;
  const auto stiff = MustBuild(description);
  EXPECT_NE(plain->content_hash(), bent->content_hash());
  EXPECT_NE(bent->content_hash(), stiff->content_hash());
  EXPECT_FALSE(plain->SameContent(*bent));
  EXPECT_FALSE(bent->SameContent(*stiff));
}

// A hinge does not move the end of its edge that is opposite two right angles.
TEST(SceneModel, ElasticElementsThatMoveNothingFreeAreLeftOut) {
  ModelDescription description;
  description.topology = TriangleMesh{.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 0, -1}},
                                      .triangles = {{0, 2, 1}, {0, 1, 3}}};
  description.material.bending_rigidity_n_m = 1e-4;
  EXPECT_EQ(MustBuild(description)->elastic_count(), 1u);
  description.pinned_particles = {0, 2, 3};
  EXPECT_EQ(MustBuild(description)->elastic_count(), 0u);
}

// The hash is in logs and may later be in files: it must not change from build to build.
TEST(SceneModel, ContentHashIsStable) {
  ModelDescription description;
  description.topology = GridTopology{.columns = 2, .rows = 2, .width_m = 1, .height_m = 1};
  EXPECT_EQ(MustBuild(description)->content_hash(), MustBuild(description)->content_hash());
  EXPECT_EQ(MustBuild(description)->content_hash(), 294310688647393227u);
}

// Wherever it stops, nothing is left; and a model comes out the same however often it was asked.
TEST(SceneModel, ABuildStopsWhereverItIsAsked) {
  ModelDescription crumpled;
  TriangleMesh mesh;
  std::mt19937 random(3);
  const auto any = [&] { return static_cast<double>(random()) / std::mt19937::max() / 20; };
  constexpr uint32_t kSide = 8;
  for (uint32_t k = 0; k < kSide * kSide; ++k) {
    mesh.positions_m.emplace_back(k % kSide + any(), k / kSide + any(), any());
  }
  for (uint32_t k = 0; k + kSide + 1 < kSide * kSide; ++k) {
    if (k % kSide + 1 == kSide) continue;
    mesh.triangles.push_back({k, k + 1, k + kSide});
    mesh.triangles.push_back({k + 1, k + kSide + 1, k + kSide});
  }
  crumpled.topology = std::move(mesh);
  crumpled.material.bending_rigidity_n_m = 1e-3;
  crumpled.let_out = {{7, 2}};  // lengths to be restored
  const auto whole = MustBuild(crumpled);
  ASSERT_TRUE(whole->is_start_restored());
  size_t asked = 0;
  StopWhenUnwanted never([&] { return ++asked == 0; });
  EXPECT_TRUE(SceneModel::Build(crumpled, {}, &never).value()->SameContent(*whole));
  const size_t asked_in_all = asked;
  ASSERT_GT(asked_in_all, 50u);
  for (size_t last = 1; last <= asked_in_all; last += 1 + last / 8) {
    asked = 0;
    StopWhenUnwanted then([&] { return ++asked == last; });
    EXPECT_THROW((void)SceneModel::Build(crumpled, {}, &then), WorkStopped) << last;
    EXPECT_EQ(asked, last);
  }
}

}  // namespace
}  // namespace drape
