// Cloths that touch themselves (server/solver/method.md, solve_self_contacts).
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/physics/physics_test.h"
#include "tests/physics/touching.h"

namespace drape::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// On llvmpipe, which takes a second for ten substeps of a heap, gl is for the long tests.
class SelfCollision : public PhysicsTest {
 protected:
  void Change(ClothHandle cloth, const ClothParameters& parameters) {
    ClothUpdate update;
    update.parameters = parameters;
    ASSERT_TRUE(backend().Write(cloth, update).ok());
  }
  // Steps the cloth and expects that no edge crosses a triangle after any step.
  StepReport StepWithoutCrossing(ClothHandle cloth, const Scene& scene, uint32_t steps) {
    StepReport report;
    for (uint32_t k = 0; k < steps; ++k) {
      report = StepAlone(backend(), cloth, scene, 1, true);
      EXPECT_EQ(report.fault, FaultReason::kNone) << scene.name << ", step " << k;
      EXPECT_EQ(report.measured.crossings, 0u) << scene.name << ", step " << k;
      EXPECT_FALSE(report.warnings.starts_crossing) << scene.name << ", step " << k;
      EXPECT_LE(report.warnings.contacts_given_up, may_give_up_) << scene.name << ", step " << k;
      if (HasFailure()) break;
    }
    return report;
  }

  bool may_give_up_ = false;
};
INSTANTIATE_TEST_SUITE_P(Backends, SelfCollision, ::testing::Values("reference", "cpu"),
                         [](const auto& case_info) { return std::string(case_info.param); });
INSTANTIATE_TEST_SUITE_P(GlLong, SelfCollision, ::testing::Values("gl"),
                         [](const auto& case_info) { return std::string(case_info.param); });
// Cheap ones, for every backend.
class SelfCollisionEverywhere : public SelfCollision {};
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(SelfCollisionEverywhere);

// Moves and turns the state, and shakes it by a tenth of a millimetre.
void Place(Scene& scene, const Matrix3d& rotation, const Vector3d& shift, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-1e-4, 1e-4);
  for (Vector3d& p : scene.state.positions_m) {
    p = rotation * p + shift + Vector3d(noise(random), noise(random), noise(random));
  }
}

Matrix3d Turned(double angle_rad, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

const Collider kFloor = PlaneThrough(Vector3d::Zero(), Vector3d::UnitY());

TEST_P(SelfCollision, ASheetDroppedOnItsEdgeFoldsWithoutCrossing) {
  for (const uint32_t substeps : {10u, 52u}) {
    Scene scene = Grid(15, 15, 0.6, 0.6);
    Touch(scene, 0.3, substeps);
    TouchItself(scene);
    scene.parameters.colliders = {kFloor};
    Place(scene, Turned(1.52, Vector3d::UnitX()), Vector3d(0, 0.7, 0), 1);
    const StepReport report = StepWithoutCrossing(Make(scene), scene, 70);
    EXPECT_GT(report.measured.near_pairs, 100u) << "it did not fold";
  }
}

TEST_P(SelfCollision, ASheetDrapedOverASphereThatVanishesPilesUp) {
  Scene scene = MeshedGrid(15, 15, 0.8, 0.8);
  Touch(scene, 0.3, 10);
  TouchItself(scene);
  scene.parameters.colliders = {kFloor, SphereAt(Vector3d(0.4, 0.4, 0.4), 0.15)};
  Place(scene, Matrix3d::Identity(), Vector3d(0, 0.56, 0), 2);
  const ClothHandle cloth = Make(scene);
  StepWithoutCrossing(cloth, scene, 30);
  scene.parameters.colliders.pop_back();
  Change(cloth, scene.parameters);
  const StepReport report = StepWithoutCrossing(cloth, scene, 50);
  EXPECT_GT(report.measured.near_pairs, 20u) << "it lies flat";
}

// Where layers hit each other hard, the links get sweeps of their own in the same substep. Without
// those the strain reaches 4 %.
TEST_P(SelfCollision, HardHitsStrainLittle) {
  constexpr double kBar = 0.03;
  Scene scene = Grid(32, 32, 1, 1);
  Touch(scene, 0.3, 52);
  TouchItself(scene);
  scene.parameters.self_collision->thickness_m = 0.003;
  scene.parameters.colliders = {kFloor, SphereAt(Vector3d(0.52, 0.5, 0.49), 0.15)};
  Place(scene, Matrix3d::Identity(), Vector3d(0, 0.68, 0), 7);
  const ClothHandle cloth = Make(scene);
  double max_strain = 0;
  uint32_t most_sweeps = 0;
  for (uint32_t step = 0; step < 27; ++step) {
    const StepReport report = StepWithoutCrossing(cloth, scene, 1);
    if (step == 0) {
      EXPECT_EQ(report.iterations, 52u) << "nothing is near yet";
    }
    max_strain = std::max(max_strain, report.measured.max_strain);
    most_sweeps = std::max(most_sweeps, report.iterations);
  }
  EXPECT_LT(max_strain, kBar);
  EXPECT_GT(most_sweeps, 52u);
  EXPECT_LE(most_sweeps, 3 * 52u) << "one sweep, and kHitSweeps";
}

// A tube around the y axis; the first and the last ring are pins.
Scene Tube(uint32_t columns, uint32_t rows, double radius_m, double length_m) {
  TriangleMesh mesh;
  ModelDescription description;
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      const double angle = 2 * M_PI * column / columns;
      mesh.positions_m.emplace_back(radius_m * std::cos(angle), length_m * row / (rows - 1),
                                    radius_m * std::sin(angle));
      if (row == 0 || row + 1 == rows) {
        description.pinned_particles.push_back(row * columns + column);
      }
      if (row + 1 == rows) continue;
      const uint32_t a = row * columns + column, b = row * columns + (column + 1) % columns;
      mesh.triangles.push_back({a, a + columns, b});
      mesh.triangles.push_back({b, a + columns, b + columns});
    }
  }
  description.topology = mesh;
  description.material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  Scene scene;
  scene.name = "Tube";
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  return scene;
}

TEST_P(SelfCollision, ATubeTwistedByATurnDoesNotCross) {
  constexpr uint32_t kColumns = 16, kRows = 14, kSteps = 60;
  constexpr double kLength_m = 0.6;
  Scene scene = Tube(kColumns, kRows, 0.08, kLength_m);
  Touch(scene, 0.2, 20);
  TouchItself(scene);
  const ClothHandle cloth = Make(scene);
  for (uint32_t step = 1; step <= kSteps; ++step) {
    const double share = double(step) / kSteps;
    scene.pin_targets_m.clear();
    for (const uint32_t pin : scene.model->pins()) {
      Vector3d target = scene.state.positions_m[pin];
      if (pin >= kColumns) {
        target = Turned(2 * M_PI * share, Vector3d::UnitY()) * target;
        target.y() -= 0.25 * kLength_m * share;
      }
      scene.pin_targets_m.push_back(target);
    }
    const StepReport report = StepWithoutCrossing(cloth, scene, 1);
    if (step < kSteps) continue;
    EXPECT_GT(report.measured.near_pairs, 50u) << "it was not twisted shut";
  }
}

// A plate comes down on a heap at 1 m/s, to less than the heap is thick.
TEST_P(SelfCollision, AFoldedSheetPressedByAPlateDoesNotCross) {
  Scene scene = Grid(13, 13, 0.4, 0.4);
  Touch(scene, 0.3, 20);
  TouchItself(scene);
  scene.parameters.colliders = {kFloor, BoxAt(Vector3d(0.2, 0.7, 0.2), Vector3d(0.5, 0.1, 0.5))};
  scene.parameters.collider_motions.resize(2);
  scene.parameters.collider_motions[1] = RigidMotion::AtRest(Vector3d(0.2, 0.7, 0.2));
  Place(scene, Turned(1.53, Vector3d::UnitX()), Vector3d(0, 0.42, 0.2), 3);
  const ClothHandle cloth = Make(scene);
  StepWithoutCrossing(cloth, scene, 25);
  scene.parameters.collider_motions[1].velocity_m_per_s = Vector3d(0, -1, 0);
  Change(cloth, scene.parameters);
  StepWithoutCrossing(cloth, scene, 34);
}

// Sizes, shapes, places, speeds, thicknesses, steps and substeps that nothing was tuned on.
void DropAtRandom(const std::function<void(const Scene&, uint32_t steps)>& play, uint32_t first,
                  uint32_t last) {
  for (uint32_t seed = first; seed < last; ++seed) {
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto columns = static_cast<uint32_t>(between(4, 18));
    const auto rows = static_cast<uint32_t>(between(4, 18));
    const double width_m = between(0.2, 1.5);
    Scene scene = seed % 2 == 0 ? Grid(columns, rows, width_m, between(0.2, 1.5))
                                : MeshedGrid(columns, rows, width_m, width_m);
    scene.name = "seed " + std::to_string(seed);
    Touch(scene, between(0, 0.6), std::array{10u, 20u, 52u}[seed % 3]);
    TouchItself(scene);
    scene.parameters.self_collision->thickness_m = between(0.001, 0.01);
    scene.parameters.settings.time_step_s = std::array{1.0 / 60, 1.0 / 30, 1.0 / 100}[seed % 5 % 3];
    const double far_m = seed % 4 == 0 ? 30 : 0;  // from the origin
    scene.parameters.colliders = {kFloor, SphereAt(Vector3d(far_m, 0.1, 0), 0.2)};
    Place(scene, Turned(between(0, 3), Vector3d(between(-1, 1), between(-1, 1), between(-1, 1))),
          Vector3d(far_m, 0.3 + 1.5 * width_m, 0), seed);
    for (Vector3d& v : scene.state.velocities_m_per_s) {
      v = Vector3d(between(-1, 1), between(-8, 0), between(-1, 1));
    }
    play(scene, static_cast<uint32_t>(1.2 / scene.parameters.settings.time_step_s));
  }
}

TEST_P(SelfCollision, RandomDropsDoNotCross) {
  DropAtRandom(
      [&](const Scene& scene, uint32_t steps) { StepWithoutCrossing(Make(scene), scene, steps); },
      1, 9);
}

class SelfCollisionLong : public SelfCollision {};
INSTANTIATE_TEST_SUITE_P(Backends, SelfCollisionLong, ::testing::Values("reference", "cpu"),
                         [](const auto& case_info) { return std::string(case_info.param); });
TEST_P(SelfCollisionLong, RandomDropsDoNotCross) {
  DropAtRandom(
      [&](const Scene& scene, uint32_t steps) { StepWithoutCrossing(Make(scene), scene, steps); },
      100, 300);
}

// Particles thrown at each other at up to 100 m/s: without a floor, so nothing outside takes
// momentum.
TEST_P(SelfCollision, ACrumplingSheetKeepsItsMomentumAndGainsNoEnergy) {
  for (const double speed : {2.0, 20.0, 100.0}) {
    Scene scene = Grid(12, 12, 0.5, 0.5);
    Touch(scene, 0.4, 20);
    TouchItself(scene);
    scene.parameters.gravity_m_per_s2.setZero();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> component(-speed, speed);
    for (Vector3d& v : scene.state.velocities_m_per_s) {
      v = Vector3d(component(random), component(random), component(random));
    }
    if (backend_name() != "reference") RoundToFloat(scene.state.velocities_m_per_s);
    const auto momentum = [&](const ParticleState& state) {
      Vector3d sum = Vector3d::Zero();
      for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
        sum += scene.model->masses_kg()[i] * state.velocities_m_per_s[i];
      }
      return sum;
    };
    const Vector3d before = momentum(scene.state);
    const ClothHandle cloth = Make(scene);
    double energy_j = std::numeric_limits<double>::infinity();
    bool has_touched = false;
    may_give_up_ = speed > 20;  // a particle goes 1.4 edges in a substep
    for (uint32_t step = 0; step < 40; ++step) {
      const StepReport report = StepWithoutCrossing(cloth, scene, 1);
      has_touched |= report.measured.near_pairs > 0;
      // Refinement moves particles without changing velocities.
      EXPECT_LE(report.measured.kinetic_energy_j, energy_j * (1 + 1e-3)) << speed << ", " << step;
      energy_j = report.measured.kinetic_energy_j;
    }
    EXPECT_TRUE(has_touched);
    // 800 substeps in which each particle takes part in up to some hundred impulses, each rounded
    // like its velocity; roundings of 144 particles add up like their root.
    const double tolerance =
        scene.model->total_mass_kg() * speed * round_off() * std::sqrt(800 * 100.0);
    EXPECT_NEAR((momentum(ReadState(backend(), cloth)) - before).norm(), 0, tolerance) << speed;
  }
}

// Sheets one above the other, as one cloth; the first may be larger than the others, around them.
Scene Layers(uint32_t layers, uint32_t side, double size_m, double spacing_m, bool is_first_pinned,
             double first_scale = 1) {
  TriangleMesh mesh;
  ModelDescription description;
  for (uint32_t layer = 0; layer < layers; ++layer) {
    const uint32_t first = layer * side * side;
    for (uint32_t i = 0; i < side * side; ++i) {
      const uint32_t column = i % side, row = i / side;
      const double scale = layer == 0 ? first_scale : 1;
      const double start_m = size_m * (1 - scale) / 2;
      // Sheets are shifted, so that no vertex lies above another.
      mesh.positions_m.emplace_back(
          start_m + scale * size_m * (column + 0.3 * (layer % 2)) / (side - 1), spacing_m * layer,
          start_m + scale * size_m * (row + 0.2 * (layer % 2)) / (side - 1));
      if (layer == 0 && is_first_pinned) description.pinned_particles.push_back(i);
      if (column + 1 == side || row + 1 == side) continue;
      const uint32_t a = first + i;
      mesh.triangles.push_back({a, a + side, a + 1});
      mesh.triangles.push_back({a + 1, a + side, a + side + 1});
    }
  }
  description.topology = mesh;
  description.material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  Scene scene;
  scene.name = "Layers";
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  return scene;
}

double MeanHeight(const ParticleState& state, uint32_t layer, uint32_t per_layer) {
  double sum = 0;
  for (uint32_t i = 0; i < per_layer; ++i) sum += state.positions_m[layer * per_layer + i].y();
  return sum / per_layer;
}

TEST_P(SelfCollision, LayersRestOneThicknessApart) {
  constexpr uint32_t kLayers = 5, kSide = 7;
  Scene scene = Layers(kLayers, kSide, 0.3, 1.5 * kLayerThickness_m, true);
  Touch(scene, 0.5, 52);
  TouchItself(scene);
  const ClothHandle cloth = Make(scene);
  StepWithoutCrossing(cloth, scene, 90);
  const ParticleState state = ReadState(backend(), cloth);
  for (uint32_t layer = 1; layer < kLayers; ++layer) {
    EXPECT_NEAR(MeanHeight(state, layer, kSide * kSide), layer * kLayerThickness_m,
                0.01 * layer * kLayerThickness_m)
        << "layer " << layer;
  }
}

// A sheet on a pinned one, on a slope whose tangent is a little below or above the static
// coefficient. (Any layers: layer_friction_test.)
TEST_P(SelfCollision, ALayerSticksBelowItsFrictionAndSlidesAboveIt) {
  constexpr uint32_t kSide = 6;
  constexpr double kFriction = 0.4, kTime_s = 0.4;
  constexpr double kMargin = 0.02;
  for (const double share : {1 - kMargin, 1 + kMargin}) {
    for (const double dynamic : {1.0, 0.5}) {
      // Described farther apart, so that they count as apart in the rest shape.
      Scene scene = Layers(2, kSide, 0.2, 2 * kLayerThickness_m, true, 3.2);
      for (Vector3d& p : scene.state.positions_m) p.y() /= 2;
      Touch(scene, 0, 52);
      TouchItself(scene);
      scene.parameters.self_collision->friction_static = kFriction;
      scene.parameters.self_collision->friction_dynamic = kFriction * dynamic;
      const double slope = std::atan(kFriction * share);
      scene.parameters.gravity_m_per_s2 = 9.81 * Vector3d(std::sin(slope), -std::cos(slope), 0);
      const ClothHandle cloth = Make(scene);
      struct Motion {
        double place_m = 0, speed = 0;
      };
      const auto motion = [&] {
        Motion mean;
        const ParticleState state = ReadState(backend(), cloth);
        for (uint32_t i = kSide * kSide; i < 2 * kSide * kSide; ++i) {
          mean.place_m += state.positions_m[i].x() / (kSide * kSide);
          mean.speed += state.velocities_m_per_s[i].x() / (kSide * kSide);
        }
        return mean;
      };
      const auto half = static_cast<uint32_t>(kTime_s / 2 * 60);
      StepWithoutCrossing(cloth, scene, half);
      const Motion middle = motion();
      StepWithoutCrossing(cloth, scene, half);
      const Motion end = motion();
      SCOPED_TRACE("slope " + std::to_string(share) + ", dynamic " + std::to_string(dynamic));
      if (share < 1) {
        // In single precision what sticks creeps: gaps and links are rounded to some per cent of
        // the way that gravity gives in a substep.
        const double creep_m_per_s = scalar() == ScalarType::kFloat64 ? 2e-4 : 1e-3;
        EXPECT_NEAR(end.place_m, middle.place_m, creep_m_per_s * kTime_s / 2);
      } else {
        const double free = 9.81 * std::sin(slope);
        // Half of what two per cent of a coefficient change.
        EXPECT_NEAR((end.speed - middle.speed) / (kTime_s / 2), free * (1 - dynamic / share),
                    0.01 * free);
      }
    }
  }
}

// A sheet whose particles are all in a tenth of its thickness: contacts of all with all.
TEST_P(SelfCollision, WhatCannotBeComputedMovesAsOneAndWarns) {
  Scene scene = Layers(1, 40, 0.3, 0, false);
  Touch(scene);
  TouchItself(scene);
  scene.parameters.self_collision->thickness_m = 0.002;
  std::mt19937 random(8);
  std::uniform_real_distribution<double> place(0, 2e-4);
  for (Vector3d& p : scene.state.positions_m) p = {place(random), place(random), place(random)};
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene);
  EXPECT_TRUE(report.warnings.contacts_given_up);
  EXPECT_TRUE(IsFinite(ReadState(backend(), cloth)));
}

TEST_P(SelfCollision, WhatStartsCrossingStaysWholeAndWarns) {
  Scene scene = Layers(2, 8, 0.3, 0, false);
  Touch(scene, 0.3, 20);
  TouchItself(scene);
  scene.parameters.colliders = {kFloor};
  for (size_t i = 0; i < scene.state.positions_m.size(); ++i) {
    Vector3d& p = scene.state.positions_m[i];
    p.y() = i < 64 ? 0.2 : 0.2 + 0.3 * (p.x() - 0.15);
  }
  const ClothHandle cloth = Make(scene);
  StepReport report = StepAlone(backend(), cloth, scene, 1, true);
  EXPECT_TRUE(report.warnings.starts_crossing);
  EXPECT_GT(report.measured.crossings, 0u);
  report = StepAlone(backend(), cloth, scene, 60, true);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  EXPECT_LT(report.measured.max_strain, 0.2);
  EXPECT_TRUE(IsFinite(ReadState(backend(), cloth)));
}

// Where nothing comes near, the cloth is what it is without self-collision, to the bit.
TEST_P(SelfCollisionEverywhere, ChangesNoBitWhereNothingIsNear) {
  Scene scene = Grid(12, 12, 1, 1, {0, 11});
  Touch(scene);
  TouchItself(scene);
  Stir(scene, 0.5);
  Scene plain = scene;
  plain.parameters.self_collision.reset();
  const ClothHandle cloth = Make(scene), other = Make(plain);
  for (uint32_t step = 0; step < 20; ++step) {
    ASSERT_EQ(StepAlone(backend(), cloth, scene, 1, true).measured.near_pairs, 0u);
    StepAlone(backend(), other, plain);
    ASSERT_EQ(ReadBits(backend(), cloth), ReadBits(backend(), other)) << step;
  }
}

}  // namespace
}  // namespace drape::test
