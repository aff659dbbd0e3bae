// Cloths of the cpu backend have the same bits side by side in the lanes of the vector registers as
// alone, with every instruction set of this machine, in groups of any size.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "tests/support/backends/backends.h"
#include "tests/support/reports.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr uint32_t kSteps = 2;
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
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  for (const Integration integration : {Integration::kTwoStep, Integration::kOneStep}) {
    const std::string suffix = integration == Integration::kTwoStep ? "_two_step" : "_one_step";
    Scene bending = With(Grid(10, 9, 0.5, 0.5, {0}, fabric), "bending" + suffix, Preset::kRealtime);
    Scene hinges = With(MeshedGrid(8, 7, 0.5, 0.5, {0}, {.bending_rigidity_n_m = 50}),
                        "hinges" + suffix, Preset::kRealtime);
    Scene springs = With(CompliantSheet(7, 1e-5), "springs" + suffix, Preset::kRealtime);
    Scene windy = Sheet("windy" + suffix, Preset::kRealtime);
    windy.parameters.wind_m_per_s = {1, 3, 2};
    windy.parameters.air_drag = 1;
    for (Scene* scene : {&bending, &hinges, &springs, &windy}) {
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

// Its velocity.
Eigen::Vector3d& FirstFree(Scene& scene) {
  size_t i = 0;
  while (scene.model->inverse_masses_per_kg()[i] == 0) ++i;
  return scene.state.velocities_m_per_s[i];
}

// So that no lane has the numbers of another one.
void Shift(Collider& collider, double way_m) {
  collider.pose.position_m.y() += way_m;
  collider.pose.rotation =
      Eigen::AngleAxisd(way_m, Eigen::Vector3d(0.6, 0, 0.8)) * collider.pose.rotation;
  if (auto* box = std::get_if<BoxShape>(&collider.shape)) box->half_extents_m.y() += way_m;
}

// One of several cloths of a scene that differ in gravity, damping, pin targets and velocities. The
// fourth blows up; the sixth is stirred so much that its strips are limited.
Scene Variant(Scene scene, uint32_t index) {
  const double x = index + 1;
  scene.parameters.gravity_m_per_s2 = {0.3 * std::sin(x), -9.81 + 0.1 * std::cos(x), 0.2 * x / 33};
  scene.parameters.friction_static *= 1 + index % 4;
  if (index % 6 == 1) scene.parameters.friction_static = scene.parameters.friction_dynamic = 0;
  if (index % 6 == 2) scene.parameters.restitution = 0;
  scene.parameters.wind_m_per_s *= 1 + 0.1 * x;
  if (scene.parameters.air_drag > 0) scene.parameters.air_lift = index % 3;
  for (Collider& collider : scene.parameters.colliders) {
    Shift(collider, 0.0005 * x);
  }
  scene.parameters.damping_per_s = index % 3 == 0 ? 0 : 0.1 * x;
  for (const uint32_t pin : scene.model->pins()) {
    const Eigen::Vector3d way{0.002 * std::cos(x), 0.001 * x / 33, -0.0005};
    scene.pin_targets_m.push_back(scene.state.positions_m[pin] + way);
  }
  Stir(scene, index % 5 == 0 ? 0.001 : 0.1 * (index % 7));
  if (index % 16 == 5) Stir(scene, 200);
  if (index % 16 == 3) FirstFree(scene).x() = 1e30;
  return scene;
}

struct Outcome {
  std::string bits;
  StepReport report;
};

std::vector<Outcome> StepTogether(Backend& backend, const std::vector<Scene>& scenes) {
  std::vector<StepItem> items;
  std::vector<Outcome> outcomes;
  for (const Scene& scene : scenes) {
    items.push_back({CreateCloth(backend, scene), scene.pin_targets_m, true});
  }
  BatchReport batch;
  for (uint32_t step = 0; step < kSteps; ++step) batch = backend.Step(items);
  for (size_t k = 0; k < items.size(); ++k) {
    outcomes.push_back({ReadBits(backend, items[k].cloth), batch.reports[k]});
    backend.Destroy(items[k].cloth);
  }
  return outcomes;
}

void ExpectSame(const Outcome& actual, const Outcome& expected, const std::string& where) {
  EXPECT_TRUE(actual.bits == expected.bits) << where;
  EXPECT_EQ(DifferenceOf(actual.report, expected.report), "") << where;
}

// The instruction sets that highway compiles for and this machine has.
std::vector<int64_t> InstructionSets() {
  hwy::SetSupportedTargetsForTest(0);
  std::vector<int64_t> sets;
  for (int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1) {
    sets.push_back(rest & -rest);
  }
  return sets;
}

// Vec4 of one instruction set, while it lives.
class OnlyInstructionSet {
 public:
  explicit OnlyInstructionSet(int64_t set) { Choose(set); }
  ~OnlyInstructionSet() { Choose(0); }
  OnlyInstructionSet(const OnlyInstructionSet&) = delete;
  OnlyInstructionSet& operator=(const OnlyInstructionSet&) = delete;

 private:
  static void Choose(int64_t set) {
    hwy::SetSupportedTargetsForTest(set);
    hwy::GetChosenTarget().DeInit();
  }
};

class LaneExactnessTest : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Scenes, LaneExactnessTest, testing::ValuesIn(Cases()),
                         [](const auto& one) { return one.param.scene.name; });

TEST_P(LaneExactnessTest, SameInGroupsOfAnySizeAsAlone) {
  const uint32_t count = *std::max_element(std::begin(kGroupSizes), std::end(kGroupSizes));
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < count; ++k) scenes.push_back(Variant(GetParam().scene, k));
  const auto single = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  const std::vector<Outcome> alone = StepTogether(*single, scenes);
  EXPECT_NE(alone[3].report.fault, FaultReason::kNone) << "one neighbour must blow up";
  EXPECT_EQ(alone[0].report.fault != FaultReason::kNone, GetParam().scene.name == "explosive");
  if (!GetParam().scene.parameters.colliders.empty()) {
    EXPECT_GT(alone[0].report.measured.contacts, 0u);
  }
  if (GetParam().exits_early) {
    std::set<uint32_t> iterations;
    for (const Outcome& one : alone) iterations.insert(one.report.iterations);
    EXPECT_GT(iterations.size(), 2u) << "sweeps must end at different times";
  }
  uint32_t most_lanes = 1;
  for (const int64_t set : InstructionSets()) {
    const OnlyInstructionSet only(set);
    most_lanes = std::max(most_lanes, cpu::SupportedLanes().lane_count);
    for (const uint32_t size : kGroupSizes) {
      const auto lanes = CreateCpuBackend({.thread_count = 1}, {.use_lanes = true});
      const std::vector<Outcome> together =
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
  const std::vector<Outcome> alone = StepTogether(*single, scenes);
  const std::vector<Outcome> together = StepTogether(*lanes, scenes);
  for (size_t k = 0; k < scenes.size(); ++k) {
    ExpectSame(together[k], alone[k], "cloth " + std::to_string(k));
  }
}

}  // namespace
}  // namespace drape::test
