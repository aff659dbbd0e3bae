// A cloth of the cpu backend has the same bits whether one thread steps it or several together.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "server/solver/cpu/alone/cloth_step.h"
#include "server/solver/cpu/alone/joints.h"
#include "server/solver/cpu/simd/denormals.h"
#include "tests/support/backends/backends.h"
#include "tests/support/reports.h"
#include "tests/support/scenes.h"

namespace drape::test {

// Large enough that every stage has ranges for several threads.
constexpr uint32_t kSide = 36;
constexpr uint32_t kSteps = 2;

void PrintTo(const Scene& scene, std::ostream* stream) {
  *stream << scene.name;
}

namespace {

Scene With(Scene scene, const std::string& name, Preset preset) {
  scene.name = name;
  scene.parameters.settings = PresetSettings(preset);
  return scene;
}

Scene Sheet(const std::string& name, Preset preset, const StructuralMaterial& material = {}) {
  Scene scene = Grid(kSide + 5, kSide, 1.2, 1, {0, kSide + 4}, material);
  Stir(scene, 0.5);
  return With(scene, name, preset);
}

// Ropes and struts along the edges of a grid, some compliant.
Scene RopesAndStruts() {
  ParticleTopology particles;
  for (uint32_t i = 0; i < kSide * kSide; ++i) {
    const uint32_t column = i % kSide, row = i / kSide;
    particles.positions_m.emplace_back(0.03 * column, 0, 0.03 * row);
    particles.masses_kg.push_back(0.002 + 0.001 * (i % 3));
    const auto tie = [&](uint32_t other) {
      particles.distance_constraints.push_back({.i = other,
                                                .j = i,
                                                .rest_length_m = 0.03,
                                                .compliance_m_per_n = i % 5 == 0 ? 1e-4 : 0,
                                                .kind = i % 3 == 0   ? ConstraintKind::kAtMost
                                                        : i % 3 == 1 ? ConstraintKind::kAtLeast
                                                                     : ConstraintKind::kEqual});
    };
    if (column > 0) tie(i - 1);
    if (row > 0) tie(i - kSide);
  }
  Scene scene = Particles(particles, {0, kSide - 1});
  Stir(scene, 0.5);
  return With(scene, "ropes_and_struts", Preset::kPaper);
}

// Chains from one pin in all directions: strips of one phase that share it.
Scene Star() {
  constexpr uint32_t kRays = 60, kLinks = 20;
  ParticleTopology particles;
  particles.positions_m.emplace_back(0, 0, 0);
  particles.masses_kg.push_back(0.01);
  for (uint32_t ray = 0; ray < kRays; ++ray) {
    const double turn = 2 * M_PI * ray / kRays;
    for (uint32_t k = 1; k <= kLinks; ++k) {
      const uint32_t i = static_cast<uint32_t>(particles.positions_m.size());
      particles.positions_m.emplace_back(0.05 * k * std::cos(turn), 0, 0.05 * k * std::sin(turn));
      particles.masses_kg.push_back(0.01);
      particles.distance_constraints.push_back(
          {.i = k == 1 ? 0 : i - 1, .j = i, .rest_length_m = 0.05});
    }
  }
  Scene scene = Particles(particles, {0});
  Stir(scene, 0.5);
  return With(scene, "star", Preset::kRealtime);
}

Scene Moving(Scene scene) {
  for (const Collider& collider : scene.parameters.colliders) {
    scene.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  scene.parameters.collider_motions[0].velocity_m_per_s = {0, 3, 0.5};
  scene.parameters.collider_motions[0].angular_velocity_rad_per_s = {0, 5, 0};
  scene.parameters.restitution = 0.5;
  return scene;
}

Scene Touching(Scene scene, const std::string& name, Preset preset) {
  for (auto& v : scene.state.velocities_m_per_s) v.y() = -4;
  return With(scene, name, preset);
}

// Colliders that particles do not reach, or reach only after they were squeezed to this share of
// the size and burst; then the step is done again with all colliders. With one sweep, particles are
// tested when they are integrated, otherwise in every sweep (ColliderReach).
Scene BesideWalls(const std::string& name, double share, uint32_t sweeps) {
  const double width_m = 1.2;
  Scene scene = Grid(kSide + 5, kSide, width_m, 1);
  for (auto& p : scene.state.positions_m) p.x() = (p.x() - width_m / 2) * share;
  scene = With(scene, name, Preset::kRealtime);
  scene.parameters.settings.substeps = 20;
  scene.parameters.settings.max_iterations = sweeps;
  scene.parameters.damping_per_s = 0.3;
  scene.parameters.colliders = {PlaneThrough({0.98 * width_m / 2, 0, 0}, {-1, 0, 0}),
                                PlaneThrough({0, -9, 0}, {0, 1, 0})};
  if (share == 1) scene.parameters.colliders.erase(scene.parameters.colliders.begin());
  return scene;
}

// Between them every stage, and every variant of it.
std::vector<Scene> Cases() {
  std::vector<Scene> cases;
  cases.push_back(Sheet("realtime", Preset::kRealtime));
  cases.push_back(Sheet("paper", Preset::kPaper));
  cases.back().parameters.settings.tolerance = 0.02;
  cases.push_back(Sheet("accurate", Preset::kAccurate));
  cases.back().parameters.settings.substeps = 8;
  cases.back().parameters.settings.tolerance = 1e-3;
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    const std::string name = "start_directions_" + std::to_string(static_cast<int>(sweep));
    cases.push_back(Sheet(name, Preset::kRealtime));
    StepSettings& settings = cases.back().parameters.settings;
    settings.substeps = 20;
    settings.sweep = sweep;
    settings.max_iterations = 2;
    settings.integration = Integration::kOneStep;
    settings.direction = Direction::kAtStart;
    settings.velocity_iterations = 2;
    cases.back().parameters.damping_per_s = 0.3;
  }
  const StructuralMaterial elastic_edges{.stretch_stiffness_n_per_m = 2000};
  cases.push_back(Sheet("compliant_strips", Preset::kRealtime, elastic_edges));
  cases.push_back(Sheet("compliant_colours", Preset::kPaper, elastic_edges));
  cases.push_back(RopesAndStruts());
  cases.push_back(Star());
  cases.push_back(Touching(FallingOnSphere(kSide), "contacts_realtime", Preset::kRealtime));
  cases.push_back(Touching(FallingOnSphere(kSide), "contacts_paper", Preset::kPaper));
  cases.back().parameters.settings.tolerance = 0.01;
  cases.push_back(
      Moving(Touching(FallingOnBoxAndCapsule(kSide), "moving_colliders", Preset::kRealtime)));
  cases.push_back(Touching(FallingOnDistanceMap(kSide), "distance_map", Preset::kRealtime));
  for (const uint32_t sweeps : {1u, 3u}) {
    const std::string suffix = "_in_" + std::to_string(sweeps);
    cases.push_back(BesideWalls("out_of_reach" + suffix, 1, sweeps));
    cases.push_back(BesideWalls("burst" + suffix, 0.9, sweeps));
  }
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  for (const Integration integration : {Integration::kTwoStep, Integration::kOneStep}) {
    const std::string suffix = integration == Integration::kTwoStep ? "_two_step" : "_one_step";
    Scene bending = Sheet("bending" + suffix, Preset::kRealtime, fabric);
    Scene hinges = With(MeshedGrid(kSide, kSide, 1, 1, {0}, {.bending_rigidity_n_m = 1}),
                        "hinges" + suffix, Preset::kRealtime);
    Scene soft_hinges = With(MeshedGrid(kSide, kSide, 1, 1, {0}, {.bending_rigidity_n_m = 1e-7}),
                             "soft_hinges" + suffix, Preset::kRealtime);
    Scene springs = With(CompliantSheet(kSide, 1e-5), "springs" + suffix, Preset::kRealtime);
    Scene windy = Sheet("windy" + suffix, Preset::kRealtime);
    windy.parameters.wind_m_per_s = {1, 3, 2};
    windy.parameters.air_drag = windy.parameters.air_lift = 1;
    for (Scene* scene : {&bending, &hinges, &soft_hinges, &springs, &windy}) {
      scene->parameters.settings.integration = integration;
      cases.push_back(*scene);
    }
  }
  cases.push_back(With(CompliantSheet(kSide, 0), "springs_in_force", Preset::kPaper));
  cases.push_back(Sheet("driven", Preset::kRealtime));
  for (const DistanceConstraint& constraint : cases.back().model->constraints()) {
    cases.back().rest_length_targets_m.push_back(0.99 * constraint.rest_length_m);
  }
  cases.push_back(With(ExplosiveSheet(kSide), "explosive", Preset::kRealtime));
  return cases;
}

std::vector<cpu::Vec4> ToVec4(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<cpu::Vec4> lanes;
  for (const Eigen::Vector3d& vector : vectors) lanes.push_back(cpu::ToVec4(vector));
  lanes.push_back(cpu::Vec4{});
  return lanes;
}

std::string Bits(const std::vector<cpu::Vec4>& lanes) {
  return {reinterpret_cast<const char*>(lanes.data()), lanes.size() * sizeof(cpu::Vec4)};
}

struct Outcome {
  std::string bits;
  StepReport report;
  bool has_far = false;  // the last step left out colliders
  uint64_t repeats = 0;
};

Outcome StepTogether(const Scene& scene, uint32_t threads, bool leaves_out_colliders = true) {
  const cpu::DenormalsAreZero denormals_are_zero;
  const cpu::FloatModel model(scene.model);
  const bool is_driven = !scene.rest_length_targets_m.empty();
  const cpu::FloatControls controls(model, scene.parameters, is_driven);
  cpu::FloatState state{ToVec4(scene.state.positions_m), ToVec4(scene.state.velocities_m_per_s)};
  std::vector<cpu::Vec4> pin_targets;
  for (const uint32_t pin : model.pins) pin_targets.push_back(state.positions[pin]);
  cpu::OwnLengths lengths;
  if (is_driven) {
    std::vector<double> starts;
    for (const auto& constraint : scene.model->constraints()) {
      starts.push_back(constraint.rest_length_m);
    }
    lengths = {cpu::PackLengths(model, starts),
               cpu::PackLengths(model, scene.rest_length_targets_m)};
  }
  cpu::Grips grips;
  cpu::StepScratch scratch;
  cpu::StepTeam team(threads);
  std::vector<std::jthread> others;
  for (uint32_t k = 1; k < threads; ++k) {
    others.emplace_back([&] {
      const cpu::DenormalsAreZero also_here;
      team.Join();
    });
  }
  while (team.member_count() < threads) std::this_thread::yield();
  StepReport report;
  for (uint32_t step = 0; step < kSteps; ++step) {
    cpu::StepContext context{model,
                             controls,
                             grips.Hold(model, pin_targets, scene.grips),
                             is_driven ? &lengths : nullptr,
                             scene.parameters.collider_motions,
                             scratch,
                             team,
                             scene.parameters.settings.max_iterations,
                             leaves_out_colliders};
    context.asks_for_impulses = true;
    context.colliders = scene.parameters.colliders;
    report = cpu::StepCloth(context, true, state);
  }
  team.Close();
  return {Bits(state.positions) + Bits(state.velocities), report, scratch.reach.has_far,
          scratch.repeats};
}

class ThreadExactnessTest : public testing::TestWithParam<Scene> {};
INSTANTIATE_TEST_SUITE_P(Scenes, ThreadExactnessTest, testing::ValuesIn(Cases()),
                         [](const auto& one) { return one.param.name; });

TEST_P(ThreadExactnessTest, SameWithSeveralThreadsAsWithOne) {
  const Scene& scene = GetParam();
  const Outcome alone = StepTogether(scene, 1);
  EXPECT_EQ(alone.report.fault != FaultReason::kNone, scene.name == "explosive");
  EXPECT_EQ(alone.repeats > 0, scene.name.starts_with("burst"));
  if (!scene.parameters.colliders.empty()) {
    const bool is_out_of_reach = scene.name.starts_with("out_of_reach");
    EXPECT_TRUE(alone.has_far || !is_out_of_reach);
    Scene without = scene;
    without.parameters.colliders = {PlaneThrough({0, -1e3, 0}, {0, 1, 0})};
    without.parameters.collider_motions.clear();
    EXPECT_EQ(StepTogether(without, 1).bits == alone.bits, is_out_of_reach);
    const Outcome with_all = StepTogether(scene, 1, false);
    EXPECT_TRUE(with_all.bits == alone.bits) << "with all colliders";
    EXPECT_EQ(DifferenceOf(with_all.report, alone.report), "");
  }
  for (const uint32_t threads : {2u, 4u}) {
    const Outcome together = StepTogether(scene, threads);
    EXPECT_TRUE(together.bits == alone.bits) << threads << " threads";
    EXPECT_EQ(DifferenceOf(together.report, alone.report), "");
    EXPECT_EQ(together.has_far, alone.has_far);
    EXPECT_EQ(together.repeats, alone.repeats);
  }
}

}  // namespace
}  // namespace drape::test
