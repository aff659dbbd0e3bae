// Cloths of the cpu backend have the same bits side by side in the lanes of the vector registers as
// alone, with every instruction set of this machine, in groups of any size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "tests/parity/lane_batches.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr uint32_t kGroupSizes[] = {1, 2, 7, 8, 15, 16, 17, 33};

struct Case {
  Scene scene;
  // Whether its cloths need different numbers of sweeps.
  bool exits_early = false;
};
void PrintTo(const Case& one, std::ostream* stream) {
  *stream << one.scene.name;
}

Scene With(Scene scene, const std::string& name, Preset preset) {
  scene.name = name;
  scene.parameters.settings = PresetSettings(preset);
  return scene;
}

Scene Sheet(const std::string& name, Preset preset) {
  return With(Grid(13, 10, 0.6, 0.5, {0, 12}), name, preset);
}

Scene Compliant(const std::string& name, Preset preset) {
  return With(Grid(9, 7, 0.5, 0.4, {0, 8}, {.stretch_stiffness_n_per_m = 2000}), name, preset);
}

// After a tenth of a second, where some particles touch.
ParticleState Settled(const Scene& scene) {
  const auto backend = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  const ClothHandle cloth = CreateCloth(*backend, scene);
  StepAlone(*backend, cloth, scene, 6);
  return ReadState(*backend, cloth);
}

// A knot in the middle of ropes and struts, held by all ends.
Scene RopesAndStruts() {
  ParticleTopology particles;
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < 7; ++k) {
    const double turn = 0.9 * k;
    particles.positions_m.push_back({k == 0 ? 0 : std::cos(turn), 0, k == 0 ? 0 : std::sin(turn)});
    particles.masses_kg.push_back(0.1 + 0.02 * k);
    if (k == 0) continue;
    particles.distance_constraints.push_back({.i = 0,
                                              .j = k,
                                              .rest_length_m = 1,
                                              .compliance_m_per_n = k == 3 ? 1e-4 : 0,
                                              .kind = k % 3 == 0   ? ConstraintKind::kAtMost
                                                      : k % 3 == 1 ? ConstraintKind::kAtLeast
                                                                   : ConstraintKind::kEqual});
    if (k % 2 == 0) pins.push_back(k);
  }
  return With(Particles(particles, pins), "ropes_and_struts", Preset::kPaper);
}

// Two bars and a rope of compliant joints, hung by one end.
Scene Jointed() {
  ParticleTopology particles;
  for (uint32_t k = 0; k < 9; ++k) {
    particles.positions_m.push_back({0.1 * (k / 3 + k % 3), 0, 0.05 * (k / 3)});
    particles.masses_kg.push_back(0.01 * (1 + k % 4));
    if (k % 3 != 0) {
      particles.distance_constraints.push_back({.i = k - 1, .j = k, .rest_length_m = 0.1});
    }
  }
  for (const double compliance : {0.0, 1e-4}) {
    const uint32_t k = compliance > 0 ? 5 : 2;
    particles.positions_m[k + 1] = particles.positions_m[k];
    particles.positions_m[k + 1].z() += 0.001;
    particles.point_joints.push_back({k, k + 1, compliance});
  }
  return With(Particles(particles, {0}), "jointed", Preset::kPaper);
}

// A hanging chain and particles that no constraint holds, among its numbers.
Scene ChainAndLooseParticles() {
  ParticleTopology particles;
  for (uint32_t k = 0; k < 12; ++k) {
    particles.positions_m.push_back({0.1 * k, 0.01 * (k % 2), 0});
    particles.masses_kg.push_back(0.01 * (1 + k % 3));
  }
  for (const auto& [i, j] : {std::pair{0u, 2u}, {2u, 5u}, {5u, 9u}}) {
    particles.distance_constraints.push_back({.i = i, .j = j, .rest_length_m = 0.1 * (j - i)});
  }
  return With(Particles(particles, {0}), "chain_and_loose_particles", Preset::kRealtime);
}

// Between them every stage that lanes have, and every variant of it.
std::vector<Case> Cases() {
  std::vector<Case> cases;
  cases.push_back({Sheet("realtime", Preset::kRealtime)});
  cases.push_back({Sheet("paper", Preset::kPaper), true});
  cases.back().scene.parameters.settings.tolerance = 0.02;
  cases.push_back({Sheet("accurate", Preset::kAccurate), true});
  cases.back().scene.parameters.settings.substeps = 8;
  cases.back().scene.parameters.settings.tolerance = 1e-4;
  cases.push_back({Compliant("compliant_strips", Preset::kRealtime)});
  cases.push_back({Compliant("compliant_colours", Preset::kPaper), true});
  cases.push_back({RopesAndStruts(), true});
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    Scene scene =
        Sheet("start_directions_" + std::to_string(static_cast<int>(sweep)), Preset::kRealtime);
    scene.parameters.settings.substeps = 20;
    scene.parameters.settings.sweep = sweep;
    scene.parameters.settings.max_iterations = 2;
    scene.parameters.settings.integration = Integration::kOneStep;
    scene.parameters.settings.direction = Direction::kAtStart;
    scene.parameters.settings.velocity_iterations = 2;
    cases.push_back({scene});
  }
  // Shares of the directions between 0 and 1 that differ with gravity.
  Scene blended = Sheet("blended_directions", Preset::kRealtime);
  blended.parameters.settings.integration = Integration::kOneStep;
  blended.parameters.settings.substeps = 30;
  cases.push_back({blended});
  Scene on_cylinder = FallingOnSphere(12);
  on_cylinder.name = "cylinder_12";
  on_cylinder.parameters.colliders = {CylinderBetween({0.3, -0.44, 0.4}, {0.7, -0.24, 0.6}, 0.2)};
  for (Scene scene : {FallingOnSphere(11), FallingOnBoxAndCapsule(10), on_cylinder}) {
    for (auto& v : scene.state.velocities_m_per_s) v.y() = -2.8;
    cases.push_back({With(scene, scene.name + "_realtime", Preset::kRealtime)});
    scene.state = Settled(scene);
    scene.parameters.restitution = 0.4;
    cases.push_back({With(scene, scene.name + "_paper", Preset::kPaper), true});
    cases.back().scene.parameters.settings.tolerance = 0.01;
    cases.back().scene.parameters.settings.substeps = 4;
  }
  cases.push_back({With(MeshHalfOnBox(9), "mesh_half_on_box", Preset::kRealtime)});
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  for (const Integration integration : {Integration::kTwoStep, Integration::kOneStep}) {
    const std::string suffix = integration == Integration::kTwoStep ? "_two_step" : "_one_step";
    Scene bending = With(Grid(10, 9, 0.5, 0.5, {0}, fabric), "bending" + suffix, Preset::kRealtime);
    Scene hinges = With(MeshedGrid(8, 7, 0.5, 0.5, {0}, {.bending_rigidity_n_m = 50}),
                        "hinges" + suffix, Preset::kRealtime);
    Scene soft_hinges = With(MeshedGrid(8, 7, 0.5, 0.5, {0}, {.bending_rigidity_n_m = 1e-5}),
                             "soft_hinges" + suffix, Preset::kRealtime);
    Scene springs = With(CompliantSheet(7, 1e-5), "springs" + suffix, Preset::kRealtime);
    Scene windy = Sheet("windy" + suffix, Preset::kRealtime);
    windy.parameters.wind_m_per_s = {1, 3, 2};
    windy.parameters.air_drag = 1;
    for (Scene* scene : {&bending, &hinges, &soft_hinges, &springs, &windy}) {
      scene->parameters.settings.integration = integration;
      cases.push_back({*scene});
    }
  }
  for (const double tolerance : {0.0, 1e-3}) {
    Scene refined = Sheet(tolerance > 0 ? "refined_to_tolerance" : "refined", Preset::kRealtime);
    refined.parameters.settings.substeps = 6;
    refined.parameters.settings.max_iterations = tolerance > 0 ? 5 : 1;
    refined.parameters.settings.tolerance = tolerance;
    refined.parameters.settings.refine_above_strain = 1e-5;
    cases.push_back({refined, tolerance > 0});
  }
  Scene refined_inside = Sheet("refined_inside_a_plane", Preset::kRealtime);
  refined_inside.parameters.settings.integration = Integration::kOneStep;
  refined_inside.parameters.settings.direction = Direction::kAtEnd;
  refined_inside.parameters.settings.substeps = 6;
  refined_inside.parameters.colliders = {PlaneThrough({0, 0.5, 0}, {0, 1, 0})};
  cases.push_back({refined_inside});
  cases.push_back({With(CompliantSheet(7, 0), "springs_in_force", Preset::kPaper), true});
  cases.back().scene.parameters.settings.tolerance = 0.02;
  cases.push_back({With(ExplosiveSheet(6), "explosive", Preset::kRealtime)});
  cases.push_back({Jointed(), true});
  cases.back().scene.parameters.settings.velocity_iterations = 2;
  cases.back().scene.parameters.settings.tolerance = 0.01;
  cases.push_back({With(Chain(20, 0.05, 0.01), "chain", Preset::kRealtime)});
  cases.push_back({ChainAndLooseParticles()});
  cases.push_back({With(SizedCloth(1), "one_particle", Preset::kPaper)});
  return cases;
}

class LaneExactnessTest : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Scenes, LaneExactnessTest, testing::ValuesIn(Cases()),
                         [](const auto& one) { return one.param.scene.name; });

TEST_P(LaneExactnessTest, SameInGroupsOfAnySizeAsAlone) {
  const uint32_t count = *std::max_element(std::begin(kGroupSizes), std::end(kGroupSizes));
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < count; ++k) scenes.push_back(Variant(GetParam().scene, k));
  const auto single = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  const std::vector<LaneOutcome> alone = StepTogether(*single, scenes);
  EXPECT_NE(alone[3].report().fault, FaultReason::kNone) << "one neighbour must blow up";
  EXPECT_EQ(alone[0].report().fault != FaultReason::kNone, GetParam().scene.name == "explosive");
  if (!GetParam().scene.parameters.colliders.empty()) {
    EXPECT_GT(alone[0].report().measured.contacts, 0u);
  }
  if (GetParam().exits_early) {
    std::set<uint32_t> iterations;
    for (const LaneOutcome& one : alone) iterations.insert(one.report().iterations);
    EXPECT_GT(iterations.size(), 2u) << "sweeps must end at different times";
  }
  uint32_t most_lanes = 1;
  for (const int64_t set : InstructionSets()) {
    const OnlyInstructionSet only(set);
    most_lanes = std::max(most_lanes, cpu::SupportedLanes().lane_count);
    for (const uint32_t size : kGroupSizes) {
      const auto lanes = CreateCpuBackend({.thread_count = 1}, {.use_lanes = true});
      const std::vector<LaneOutcome> together =
          StepTogether(*lanes, {scenes.begin(), scenes.begin() + size});
      for (uint32_t k = 0; k < size; ++k) {
        ExpectSame(together[k], alone[k],
                   "cloth " + std::to_string(k) + " of " + std::to_string(size) + " with " +
                       cpu::SupportedLanes().name);
      }
    }
  }
#if defined(__x86_64__)
  EXPECT_GE(most_lanes, 4u) << "this machine has no lanes to test";
#endif
}

// Batches of several models, in which only some cloths can share lanes.
TEST(MixedLaneExactnessTest, SameInMixedBatchesAsAlone) {
  const Scene sheet = Sheet("sheet", Preset::kRealtime), other = SizedCloth(77);
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 80; ++k) {
    Scene scene = Variant(k % 5 == 0 ? other : sheet, k);
    if (k % 4 == 1) scene.parameters.settings.max_iterations = 2;
    if (k % 8 == 2) scene.parameters.air_drag = 1;
    if (k % 8 == 6) scene.parameters.colliders = {PlaneThrough({0, -0.01, 0}, {0, 1, 0})};
    if (k % 16 == 6) {
      scene.parameters.collider_motions = {RigidMotion::AtRest(Eigen::Vector3d::Zero())};
    }
    if (k % 8 == 3) scene.parameters.settings.substeps = 10;
    scenes.push_back(scene);
  }
  const auto single = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  const auto lanes = CreateCpuBackend({.thread_count = 2}, {.use_lanes = true});
  const std::vector<LaneOutcome> alone = StepTogether(*single, scenes);
  const std::vector<LaneOutcome> together = StepTogether(*lanes, scenes);
  for (size_t k = 0; k < scenes.size(); ++k) {
    ExpectSame(together[k], alone[k], "cloth " + std::to_string(k));
  }
}

}  // namespace
}  // namespace drape::test
