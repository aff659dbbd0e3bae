// Cloths of the cpu backend that hold different particles, or whose colliders move, share lanes and
// have the same bits there as alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <ostream>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu/model/layout.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "tests/parity/lane_batches.h"
#include "tests/support/scenes.h"

namespace drape::test {
namespace {

using Pins = std::vector<uint32_t>;

struct Case {
  std::string name;
  std::function<Scene(const Pins& pins)> make;
};
void PrintTo(const Case& one, std::ostream* stream) {
  *stream << one.name;
}

Scene With(Scene scene, Preset preset) {
  scene.parameters.settings = PresetSettings(preset);
  return scene;
}

Scene Sheet(const Pins& pins, Preset preset, const StructuralMaterial& material = {}) {
  return With(Grid(13, 10, 0.6, 0.5, pins, material), preset);
}

// A chain of compliant joints, ropes, struts and springs.
Scene MixedChain(const Pins& pins) {
  ParticleTopology particles;
  for (uint32_t k = 0; k < 24; ++k) {
    particles.positions_m.push_back({0.1 * (k / 2), 0.02 * (k % 3), 0.1 * (k % 2)});
    particles.masses_kg.push_back(0.01 * (1 + k % 4));
    if (k < 2) continue;
    particles.distance_constraints.push_back({.i = k - 2,
                                              .j = k,
                                              .rest_length_m = 0.1,
                                              .kind = k % 3 == 0   ? ConstraintKind::kAtMost
                                                      : k % 3 == 1 ? ConstraintKind::kAtLeast
                                                                   : ConstraintKind::kEqual});
    particles.springs.push_back({k - 2, k - 1, 0.11, 4, 0.01});
  }
  for (const uint32_t k : {4u, 9u, 15u}) {
    particles.positions_m[k + 3] = particles.positions_m[k];
    particles.positions_m[k + 3].z() += 0.001;
    particles.point_joints.push_back({k, k + 3, k == 9 ? 0 : 1e-4});
  }
  return With(Particles(particles, pins), Preset::kPaper);
}

// Every stage that lanes have, on models that hold what `pins` say.
std::vector<Case> Cases() {
  std::vector<Case> cases;
  cases.push_back({"realtime", [](const Pins& p) { return Sheet(p, Preset::kRealtime); }});
  cases.push_back({"paper", [](const Pins& p) {
                     Scene scene = Sheet(p, Preset::kPaper);
                     scene.parameters.settings.tolerance = 0.02;
                     return scene;
                   }});
  cases.push_back({"accurate", [](const Pins& p) {
                     Scene scene = Sheet(p, Preset::kAccurate);
                     scene.parameters.settings.substeps = 8;
                     scene.parameters.settings.tolerance = 1e-4;
                     return scene;
                   }});
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    const std::string suffix = preset == Preset::kPaper ? "_colours" : "_strips";
    cases.push_back({"compliant" + suffix, [preset](const Pins& p) {
                       return Sheet(p, preset, {.stretch_stiffness_n_per_m = 2000});
                     }});
  }
  for (const Sweep sweep : {Sweep::kStrips, Sweep::kColours}) {
    const std::string suffix = sweep == Sweep::kStrips ? "_strips" : "_colours";
    cases.push_back({"start_directions" + suffix, [sweep](const Pins& p) {
                       Scene scene = Sheet(p, Preset::kRealtime);
                       scene.parameters.settings.substeps = 20;
                       scene.parameters.settings.sweep = sweep;
                       scene.parameters.settings.max_iterations = 2;
                       scene.parameters.settings.integration = Integration::kOneStep;
                       scene.parameters.settings.direction = Direction::kAtStart;
                       scene.parameters.settings.velocity_iterations = 2;
                       return scene;
                     }});
  }
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  for (const Integration integration : {Integration::kTwoStep, Integration::kOneStep}) {
    const std::string suffix = integration == Integration::kTwoStep ? "_two_step" : "_one_step";
    const auto add = [&](const std::string& name, const std::function<Scene(const Pins&)>& make) {
      cases.push_back({name + suffix, [make, integration](const Pins& p) {
                         Scene scene = make(p);
                         scene.parameters.settings.integration = integration;
                         return scene;
                       }});
    };
    add("fabric", [fabric](const Pins& p) { return Sheet(p, Preset::kRealtime, fabric); });
    add("soft_fabric", [](const Pins& p) {
      return Sheet(p, Preset::kRealtime,
                   {.bending_rigidity_n_m = 1e-8, .shear_modulus_n_per_m = 0.01});
    });
    // By lines of elements.
    add("stiff_fabric", [](const Pins& p) {
      return Sheet(p, Preset::kRealtime,
                   {.bending_rigidity_n_m = 20, .shear_modulus_n_per_m = 2e5});
    });
    for (const double rigidity : {1e-8, 50.0}) {
      add(rigidity > 1 ? "hinges" : "soft_hinges", [rigidity](const Pins& p) {
        return With(MeshedGrid(9, 8, 0.5, 0.5, p, {.bending_rigidity_n_m = rigidity}),
                    Preset::kRealtime);
      });
    }
    add("springs", [](const Pins& p) {
      return Sheet(p, Preset::kRealtime,
                   {.stretch_compliance_m_per_n = 1e-5,
                    .bending_stiffness_n_per_m = 0.5,
                    .shear_stiffness_n_per_m = 2});
    });
    add("windy", [](const Pins& p) {
      Scene scene = Sheet(p, Preset::kRealtime);
      scene.parameters.wind_m_per_s = {1, 3, 2};
      scene.parameters.air_drag = 1;
      return scene;
    });
  }
  cases.push_back({"springs_in_force", [](const Pins& p) {
                     return Sheet(p, Preset::kPaper,
                                  {.bending_stiffness_n_per_m = 0.5, .shear_stiffness_n_per_m = 2});
                   }});
  // Small and heavy for its substeps: spans give way, of some cloths these, of others those.
  cases.push_back(
      {"spans", [](const Pins& p) {
         std::set<uint32_t> pins(p.begin(), p.end());
         if (p.size() % 2 == 1) pins.insert({0, 12});
         if (p.size() > 1) pins.insert({3, 119});
         return With(Grid(13, 10, 0.06, 0.05, {pins.begin(), pins.end()}), Preset::kRealtime);
       }});
  cases.push_back({"refined", [](const Pins& p) {
                     Scene scene = Sheet(p, Preset::kRealtime);
                     scene.parameters.settings.substeps = 6;
                     scene.parameters.settings.refine_above_strain = 1e-5;
                     return scene;
                   }});
  for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
    const std::string suffix = preset == Preset::kPaper ? "_paper" : "_realtime";
    cases.push_back({"colliders" + suffix, [preset](const Pins& p) {
                       Scene scene = Sheet(p, preset);
                       for (auto& v : scene.state.velocities_m_per_s) v.y() = -2.8;
                       scene.parameters.colliders = {
                           SphereAt({0.2, -0.12, 0.2}, 0.11),
                           BoxAt({0.45, -0.07, 0.3}, {0.1, 0.05, 0.1},
                                 Eigen::Quaterniond(1, 0, 0.1, 0.1).normalized()),
                           SphereAt({0, 3, 0}, 0.1)};
                       scene.parameters.friction_static = 0.5;
                       scene.parameters.friction_dynamic = 0.4;
                       scene.parameters.restitution = 0.3;
                       scene.parameters.settings.tolerance = preset == Preset::kPaper ? 0.01 : 0;
                       return scene;
                     }});
  }
  cases.push_back({"mixed_chain", MixedChain});
  return cases;
}

Pins RandomPins(uint32_t particle_count, uint32_t count, std::mt19937& random) {
  std::set<uint32_t> pins;
  for (uint32_t k = 0; k < count; ++k)
    pins.insert(static_cast<uint32_t>(random()) % particle_count);
  return {pins.begin(), pins.end()};
}

// Without pins, with one and with several, some cloths with the pins of others.
Pins RandomPins(uint32_t particle_count, uint32_t index) {
  std::mt19937 random(index - index % 4 / 3);
  return RandomPins(particle_count, index % 5, random);
}

// The bits of the last `sizes` of these cloths are the same in lanes as alone.
void ExpectSameInLanes(const std::vector<Scene>& scenes, const std::vector<size_t>& sizes) {
  const auto single = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  const std::vector<LaneOutcome> alone = StepTogether(*single, scenes);
  EXPECT_NE(alone[3].report().fault, FaultReason::kNone) << "one neighbour must blow up";
  for (const int64_t set : InstructionSets()) {
    const OnlyInstructionSet only(set);
    for (const size_t size : sizes) {
      const size_t begin = scenes.size() - size;
      const auto lanes = CreateCpuBackend({.thread_count = 1}, {.use_lanes = true});
      const std::vector<LaneOutcome> together = StepTogether(
          *lanes, {scenes.begin() + static_cast<std::ptrdiff_t>(begin), scenes.end()}, begin);
      for (size_t k = 0; k < size; ++k) {
        ExpectSame(together[k], alone[begin + k],
                   "cloth " + std::to_string(begin + k) + " in " + std::to_string(size) + " with " +
                       cpu::SupportedLanes().name);
      }
    }
  }
}

class OwnPinsTest : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Scenes, OwnPinsTest, testing::ValuesIn(Cases()),
                         [](const auto& one) { return one.param.name; });

TEST_P(OwnPinsTest, SameInGroupsAsAlone) {
  const uint32_t particle_count = GetParam().make({}).model->particle_count();
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 49; ++k) {
    scenes.push_back(Variant(GetParam().make(RandomPins(particle_count, k)), k));
  }
  const auto fits_first = [&](const Scene& scene) {
    return cpu::FitsLayout(*scene.model, *scenes[0].model);
  };
  EXPECT_GT(std::ranges::count_if(scenes, fits_first), 32) << "most can share lanes";
  ExpectSameInLanes(scenes, {7, 49});
}

// Particles have tethers to more pins than a cloth has of them, to pins beyond the 64th, too.
TEST(ManyOwnPinsTest, SameInGroupsAsAlone) {
  constexpr uint32_t kColumns = 16, kRows = 12;
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 49; ++k) {
    std::mt19937 random(k);
    Pins pins;
    for (const uint32_t pin : RandomPins(kColumns * kRows, k % 7 == 0 ? 400 : 14 + k % 9, random)) {
      // No two are neighbours, whose link would be left out.
      if ((pin % kColumns + pin / kColumns) % 2 == 0) pins.push_back(pin);
    }
    EXPECT_EQ(pins.size() > 70, k % 7 == 0);
    scenes.push_back(Variant(With(Grid(kColumns, kRows, 0.6, 0.5, pins), Preset::kRealtime), k));
  }
  const auto fits_first = [&](const Scene& scene) {
    return cpu::FitsLayout(*scene.model, *scenes[0].model);
  };
  EXPECT_GT(std::ranges::count_if(scenes, fits_first), 32) << "most can share lanes";
  ExpectSameInLanes(scenes, {49});
}

// Cloths of one model, and of several, that grip different particles, some none.
TEST_P(OwnPinsTest, WithGripsTheSameInGroupsAsAlone) {
  const uint32_t particle_count = GetParam().make({}).model->particle_count();
  const Scene pinned = GetParam().make({0, particle_count - 1});
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 49; ++k) {
    const Pins others = RandomPins(particle_count, 101 + k);
    // The first model is the layout of the others.
    const bool is_pinned = k > 0 && k < 33;
    scenes.push_back(
        Variant(is_pinned ? pinned : GetParam().make(RandomPins(particle_count, k)), k));
    Scene& scene = scenes.back();
    const std::span<const double> w = scene.model->inverse_masses_per_kg();
    Pins gripped;
    for (const uint32_t i : others) {
      if (w[i] != 0) gripped.push_back(i);
    }
    // Neighbours too: nothing moves the link between them.
    if (k % 7 == 2) gripped = {2, 3, 4};
    std::erase_if(gripped, [&](uint32_t i) { return w[i] == 0; });
    GripParticles(scene, gripped, {0.001 * k, 0.002, -0.001});
  }
  ExpectSameInLanes(scenes, {7, 49});
}

// A cloth that falls onto two colliders of which the first moves and turns, each its own way.
Scene OnMovingColliders(Scene scene, uint32_t index) {
  for (auto& v : scene.state.velocities_m_per_s) v.y() = -2.8;
  scene = Variant(scene, index);
  const double x = index + 1;
  for (const Collider& collider : scene.parameters.colliders) {
    scene.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  RigidMotion& first = scene.parameters.collider_motions[0];
  first.velocity_m_per_s = {0.5 * std::sin(x), 1, 0.1};
  first.position_m.x() += 0.01 * std::cos(x);
  if (index % 3 != 0) {
    first.angular_velocity_rad_per_s = {std::cos(x), 5, 0.1};
    first.rotation = Eigen::AngleAxisd(0.1 * x, Eigen::Vector3d::UnitY());
  }
  return scene;
}

struct MovingCase {
  Scene scene;
  Preset preset;
};
void PrintTo(const MovingCase& one, std::ostream* stream) {
  *stream << one.scene.name;
}

std::vector<MovingCase> MovingCases() {
  Scene on_cylinder = FallingOnSphere(12);
  on_cylinder.name = "cylinder_12";
  on_cylinder.parameters.colliders = {CylinderBetween({0.3, -0.24, 0.4}, {0.7, -0.24, 0.6}, 0.2)};
  std::vector<MovingCase> cases;
  for (const Scene& scene :
       {FallingOnSphere(11), FallingOnBoxAndCapsule(10), on_cylinder, FallingOnDistanceMap(10)}) {
    for (const Preset preset : {Preset::kRealtime, Preset::kPaper}) {
      cases.push_back({With(scene, preset), preset});
      cases.back().scene.name += preset == Preset::kPaper ? "_paper" : "_realtime";
      cases.back().scene.parameters.restitution = preset == Preset::kPaper ? 0.4 : 0;
      cases.back().scene.parameters.settings.substeps = preset == Preset::kPaper ? 4 : 52;
      cases.back().scene.parameters.settings.collider_contact = ColliderContact::kParticles;
    }
  }
  return cases;
}

class MovingLanesTest : public testing::TestWithParam<MovingCase> {};
INSTANTIATE_TEST_SUITE_P(Scenes, MovingLanesTest, testing::ValuesIn(MovingCases()),
                         [](const auto& one) { return one.param.scene.name; });

TEST_P(MovingLanesTest, SameInGroupsAsAlone) {
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 49; ++k) {
    scenes.push_back(OnMovingColliders(GetParam().scene, k));
    if (k % 8 == 4) scenes.back().parameters.collider_motions.clear();
  }
  ExpectSameInLanes(scenes, {7, 49});
  const auto single = CreateCpuBackend({.thread_count = 1}, {.use_lanes = false});
  EXPECT_GT(StepTogether(*single, {scenes[0]})[0].report().measured.contacts, 0u);
}

// Both at once: a group whose cloths hold different particles and meet moving colliders.
TEST(MovingLanesWithOwnPinsTest, SameInGroupsAsAlone) {
  const Scene falling = FallingOnBoxAndCapsule(10);
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 33; ++k) {
    Scene scene = With(Grid(10, 10, 1, 1, {k, 99 - 2 * k}), Preset::kRealtime);
    scene.parameters = falling.parameters;
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.collider_contact = ColliderContact::kParticles;
    scenes.push_back(OnMovingColliders(scene, k));
  }
  ExpectSameInLanes(scenes, {33});
}

// The edges of some touch what moves, so that those are stepped alone; of others it is far, or
// comes so fast that particles may get where they were not expected.
TEST(EdgesInLanesTest, SameInGroupsAsAlone) {
  for (const ColliderContact contact : {ColliderContact::kAuto, ColliderContact::kSurface}) {
    std::vector<Scene> scenes;
    for (uint32_t k = 0; k < 33; ++k) {
      Scene scene = With(FallingOnBoxAndCapsule(10), Preset::kRealtime);
      scene.parameters.settings.collider_contact = contact;
      scenes.push_back(OnMovingColliders(scene, k));
      RigidMotion& box = scenes.back().parameters.collider_motions[0];
      if (k % 3 != 0) box.position_m.y() -= 0.4 * (k % 5);
      if (k % 7 == 1) box.velocity_m_per_s.y() = 30;
    }
    ExpectSameInLanes(scenes, {7, 33});
  }
}

// A box that rests, and what is held moves in the first step of some: by pins, or by grips.
TEST(EdgesInLanesTest, SameInGroupsAsAloneWhilePulled) {
  const Pins held = {9, 90};
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < 33; ++k) {
    const bool is_gripped = k % 2 == 1;
    const Scene falling = FallingOnBoxAndCapsule(10);
    Scene scene = is_gripped ? falling : Grid(10, 10, 1, 1, held);
    scene.state = falling.state;
    scene.parameters = falling.parameters;
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    for (auto& v : scene.state.velocities_m_per_s) v.y() = -2.8;
    scene = Variant(scene, k);
    scene.pin_targets_m.clear();
    const Eigen::Vector3d way_m =
        k % 3 == 0 ? Eigen::Vector3d(0.004, 0.001 * k, -0.003) : Eigen::Vector3d(0, 0, 0);
    if (is_gripped) {
      GripParticles(scene, held, way_m);
    } else {
      for (const uint32_t i : held) {
        scene.pin_targets_m.push_back(scene.state.positions_m[i] + way_m);
      }
    }
    scenes.push_back(scene);
  }
  ExpectSameInLanes(scenes, {7, 33});
}

}  // namespace
}  // namespace drape::test
