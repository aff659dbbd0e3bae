// Cloths that touch each other (server/solver/method.md, Worlds).
#include <array>
#include <cmath>
#include <random>

#include "server/solver/solver_constants.h"
#include "tests/physics/physics_test.h"
#include "tests/physics/touching.h"
#include "tests/support/worlds/worlds.h"

namespace drape::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Collider kFloor = PlaneThrough(Vector3d::Zero(), Vector3d::UnitY());

// gl leaves worlds to cpu.
class Worlds : public PhysicsTest {
 protected:
  // Steps the world and expects that no edge crosses a triangle after any step.
  std::vector<StepReport> StepWithoutCrossing(ClothWorld& world, uint32_t steps) {
    std::vector<StepReport> reports;
    for (uint32_t step = 0; step < steps && !HasFailure(); ++step) {
      reports = world.Step(1, true);
      EXPECT_EQ(world.Crossings(), 0u) << "step " << step;
      for (const StepReport& report : reports) {
        EXPECT_EQ(report.fault, FaultReason::kNone) << "step " << step;
        EXPECT_EQ(report.measured.crossings, 0u) << "step " << step;
        EXPECT_FALSE(report.warnings.starts_crossing) << "step " << step;
      }
    }
    return reports;
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, Worlds, ::testing::Values("reference", "cpu"),
                         [](const auto& case_info) { return std::string(case_info.param); });

void Move(Scene& scene, const Vector3d& shift, const Vector3d& velocity = Vector3d::Zero()) {
  for (Vector3d& p : scene.state.positions_m) p += shift;
  for (Vector3d& v : scene.state.velocities_m_per_s) v = velocity;
}

void Turn(Scene& scene, double angle_rad, const Vector3d& axis) {
  const Matrix3d rotation = Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
  for (Vector3d& p : scene.state.positions_m) p = rotation * p;
}

void Shake(Scene& scene, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-1e-4, 1e-4);
  for (Vector3d& p : scene.state.positions_m) {
    p += Vector3d(noise(random), noise(random), noise(random));
  }
}

// A grid and a mesh of other cells fall over a sphere, one after the other.
TEST_P(Worlds, AGridAndAMeshThatFallOntoEachOtherDoNotCross) {
  for (const uint32_t substeps : {10u, 52u}) {
    Scene lower = Grid(13, 13, 0.6, 0.6), upper = MeshedGrid(11, 11, 0.55, 0.55);
    uint32_t seed = 1;
    for (Scene* const scene : {&lower, &upper}) {
      Touch(*scene, 0.3, substeps);
      TouchItself(*scene);
      scene->parameters.colliders = {kFloor, SphereAt(Vector3d(0.3, 0.2, 0.3), 0.15)};
      Shake(*scene, seed++);
    }
    Move(lower, {0, 0.4, 0});
    Move(upper, {0.03, 0.55, 0.01}, {0, -2, 0});
    ClothWorld world(backend(), 1, {lower, upper});
    const auto reports = StepWithoutCrossing(world, 60);
    for (const StepReport& report : reports) EXPECT_GT(report.measured.near_pairs, 0u);
  }
}

double MeanHeight(const ParticleState& state) {
  double sum = 0;
  for (const Vector3d& p : state.positions_m) sum += p.y();
  return sum / static_cast<double>(state.positions_m.size());
}

// Half the sum of the thicknesses of each two; cells of each layer lie otherwise.
TEST_P(Worlds, LayersOfOtherThicknessRestHalfTheirSumApart) {
  constexpr std::array<double, 5> kThicknesses_m = {0.004, 0.002, 0.006, 0.003, 0.004};
  std::vector<Scene> layers;
  double height_m = kThicknesses_m[0];
  std::vector<double> expected_m;
  for (size_t k = 0; k < kThicknesses_m.size(); ++k) {
    const auto side = static_cast<uint32_t>(7 + k % 2);
    Scene layer = k % 2 == 0 ? Grid(side, side, 0.3, 0.3) : MeshedGrid(side, side, 0.3, 0.3);
    Touch(layer, 0.5, 52);
    layer.parameters.thickness_m = kThicknesses_m[k];
    layer.parameters.colliders = {kFloor};
    if (k > 0) height_m += (kThicknesses_m[k - 1] + kThicknesses_m[k]) / 2;
    expected_m.push_back(height_m);
    Move(layer,
         {0.004 * static_cast<double>(k % 2), height_m * 1.3, 0.003 * static_cast<double>(k % 3)});
    layers.push_back(std::move(layer));
  }
  ClothWorld world(backend(), 1, std::move(layers));
  StepWithoutCrossing(world, 90);
  const double floor_m = MeanHeight(world.State(0));
  EXPECT_NEAR(floor_m, expected_m[0], 0.01 * expected_m[0]);
  for (size_t k = 1; k < expected_m.size(); ++k) {
    const double wanted_m = expected_m[k] - expected_m[0];
    EXPECT_NEAR(MeanHeight(world.State(k)) - floor_m, wanted_m, 0.01 * wanted_m) << "layer " << k;
  }
}

Vector3d Momentum(const ClothWorld& world, size_t cloths) {
  Vector3d sum = Vector3d::Zero();
  for (size_t k = 0; k < cloths; ++k) {
    const ParticleState state = world.State(k);
    for (size_t i = 0; i < state.positions_m.size(); ++i) {
      sum += world.scene(k).model->masses_kg()[i] * state.velocities_m_per_s[i];
    }
  }
  return sum;
}

TEST_P(Worlds, TwoFreeSheetsThatCollideKeepTheirMomentumAndGainNoEnergy) {
  for (const double speed : {1.0, 10.0, 60.0}) {
    Scene one = Grid(10, 10, 0.4, 0.4), other = MeshedGrid(9, 9, 0.4, 0.4);
    for (Scene* const scene : {&one, &other}) {
      Touch(*scene, 0.4, 20);
      TouchItself(*scene);
      scene->parameters.gravity_m_per_s2.setZero();
    }
    Move(one, {0, 0, 0}, {0, speed, 0});
    Turn(other, 0.3, {1, 0, 1});
    // So far that they meet after half a step.
    Move(other, {0.05, 0.1 + speed / 120, 0}, {0, -speed / 2, 0});
    ClothWorld world(backend(), 1, {one, other});
    const Vector3d before = Momentum(world, 2);
    const double start_j =
        (one.model->total_mass_kg() + other.model->total_mass_kg() / 4) * speed * speed / 2;
    double energy_j = start_j;
    bool have_touched = false;
    for (uint32_t step = 0; step < 30 && !HasFailure(); ++step) {
      const auto reports = world.Step(1, true);
      EXPECT_EQ(world.Crossings(), 0u) << speed << ", " << step;
      have_touched |= reports[0].measured.near_pairs > 0;
      double now_j = 0;
      for (const StepReport& report : reports) {
        now_j += report.measured.kinetic_energy_j + report.measured.strain_energy_j;
      }
      // What the links of a mesh add by themselves, the energy watch bounds.
      EXPECT_LE(now_j, energy_j * (1 + kMaxEnergyGain)) << speed << ", " << step;
      EXPECT_LE(now_j, start_j) << speed << ", " << step;
      energy_j = now_j;
    }
    EXPECT_TRUE(have_touched) << speed;
    // 600 substeps in which each particle takes part in up to some hundred impulses, each rounded
    // like its velocity; their roundings add up like their root.
    const double mass_kg = one.model->total_mass_kg() + other.model->total_mass_kg();
    const double tolerance = mass_kg * speed * round_off() * std::sqrt(600 * 100.0);
    EXPECT_NEAR((Momentum(world, 2) - before).norm(), 0, tolerance) << speed;
  }
}

// In a step of few substeps, up to the whole way of a frame in one: what flies by several cells in
// a substep is looked for no less.
TEST_P(Worlds, FastSheetsDoNotPassThroughEachOtherInFewSubsteps) {
  constexpr uint32_t kSide = 9, kSteps = 4;  // they meet within two
  for (uint32_t seed = 1; seed <= 24; ++seed) {
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    Scene one = Grid(kSide, kSide, 0.4, 0.4), other = MeshedGrid(kSide - 1, kSide - 1, 0.35, 0.35);
    const double speed = std::exp(between(std::log(1.0), std::log(60.0)));
    for (Scene* const scene : {&one, &other}) {
      Touch(*scene, between(0, 0.5), 1 + seed % 4 % 3);
      TouchItself(*scene);
      scene->parameters.settings.max_iterations = 1 + seed % 4;
      scene->parameters.gravity_m_per_s2.setZero();
    }
    Turn(other, between(-0.05, 0.05), {between(-1, 1), 0.1, between(-1, 1)});
    Shake(one, seed);
    const double ahead = between(0.2, 2) * speed / 60;  // of when they meet
    Move(one, {0, 0, 0}, {0, speed, 0});
    Move(other, {between(0, 0.05), 0.03 + ahead, between(0, 0.05)}, {0, -speed / 2, 0});
    SCOPED_TRACE(seed);
    ClothWorld world(backend(), 1, {one, other});
    StepWithoutCrossing(world, kSteps);
    // Their middles are on the same sides as before; rims fly on and wrap around the other.
    const auto middle = [&](size_t cloth, uint32_t side) {
      return world.State(cloth).positions_m[side / 2 * side + side / 2].y();
    };
    EXPECT_LT(middle(0, kSide), middle(1, kSide - 1));
  }
}

// A sheet on a pinned one, on a slope whose tangent is a little below or above a coefficient. That
// of the pair is the geometric mean.
struct Slope {
  double tangent;
  double friction_static, friction_dynamic;
  double start_speed_m_per_s = 0;
};
class SheetOnSheet : public Worlds {
 protected:
  static constexpr double kTime_s = 0.5;
  static constexpr uint32_t kSide = 6;

  // How far the upper sheet goes down the slope.
  double WayOn(const Slope& slope) {
    std::vector<uint32_t> all(kSide * kSide);
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    Scene lower = MeshedGrid(kSide, kSide, 1, 0.2, all),
          upper = MeshedGrid(kSide, kSide, 0.2, 0.15);
    const double angle = std::atan(slope.tangent);
    double factor = 2;
    for (Scene* const scene : {&lower, &upper}) {
      Touch(*scene, 0, 52);
      scene->parameters.friction_static = slope.friction_static * factor;
      scene->parameters.friction_dynamic = slope.friction_dynamic * factor;
      factor = 1 / factor;
      scene->parameters.gravity_m_per_s2 = 9.81 * Vector3d(std::sin(angle), -std::cos(angle), 0);
    }
    Move(upper, {0.013, kLayerThickness_m, 0.021}, {slope.start_speed_m_per_s, 0, 0});
    ClothWorld world(backend(), 1, {lower, upper});
    const auto place = [&] {
      double sum = 0;
      for (const Vector3d& p : world.State(1).positions_m) sum += p.x();
      return sum / (kSide * kSide);
    };
    const double before = place();
    StepWithoutCrossing(world, static_cast<uint32_t>(kTime_s * 60));
    return place() - before;
  }
  // What sliding adds to the way.
  static double Slides_m(const Slope& slope) {
    const double angle = std::atan(slope.tangent);
    return 9.81 * (std::sin(angle) - slope.friction_dynamic * std::cos(angle)) / 2 * kTime_s *
           kTime_s;
  }
  // In single precision what sticks creeps: gaps and links are rounded to some per cent of the way
  // that gravity gives in a substep.
  double Creep_m() { return (scalar() == ScalarType::kFloat64 ? 2e-4 : 2e-3) * kTime_s; }
};
INSTANTIATE_TEST_SUITE_P(Backends, SheetOnSheet, ::testing::Values("reference", "cpu"),
                         [](const auto& case_info) { return std::string(case_info.param); });

constexpr double kFriction = 0.4;

TEST_P(SheetOnSheet, SticksBelowItsFrictionAndSlidesAboveIt) {
  EXPECT_NEAR(WayOn({0.98 * kFriction, kFriction, kFriction}), 0, Creep_m());
  // Of the coefficient, within a quarter of these 2 %.
  const Slope above{1.02 * kFriction, kFriction, kFriction};
  EXPECT_NEAR(WayOn(above), Slides_m(above), Slides_m(above) / 4);
}

// What begins to slide has the static friction until it is faster than that stops in six substeps
// (method.md, (52)), and then the dynamic one.
TEST_P(SheetOnSheet, SticksBelowStaticFrictionAndSlidesAboveItWithDynamicFriction) {
  constexpr double kDynamic = 0.75 * kFriction;
  EXPECT_NEAR(WayOn({0.98 * kFriction, kFriction, kDynamic}), 0, Creep_m());
  const Slope above{1.02 * kFriction, kFriction, kDynamic};
  const double angle = std::atan(above.tangent);
  const double at_first = 9.81 * (std::sin(angle) - kFriction * std::cos(angle));
  const double later = 9.81 * (std::sin(angle) - kDynamic * std::cos(angle));
  const double speed = 6 * kFriction * 9.81 / (52 * 60);
  const double left_s = kTime_s - speed / at_first;
  const double way_m =
      speed * speed / (2 * at_first) + speed * left_s + later / 2 * left_s * left_s;
  // Of the dynamic coefficient, within 2 %.
  EXPECT_NEAR(WayOn(above), way_m, 0.02 * kDynamic * 9.81 / 2 * kTime_s * kTime_s);
}

TEST_P(SheetOnSheet, SlowsDownBelowDynamicFrictionAndSpeedsUpAboveIt) {
  constexpr double kSpeed_m_per_s = 0.3, kDynamic = 0.3;
  for (const double share : {0.98, 1.02}) {
    const Slope slope{share * kDynamic, 1.3 * kDynamic, kDynamic, kSpeed_m_per_s};
    // Of the coefficient, within half of these 2 %.
    EXPECT_NEAR(WayOn(slope) - kSpeed_m_per_s * kTime_s, Slides_m(slope),
                std::fabs(Slides_m(slope)) / 2)
        << share;
  }
}

// Where nothing comes near, each cloth is what it is alone, to the bit.
TEST_P(Worlds, ChangeNoBitWhereNothingIsNear) {
  for (const double tolerance : {0.0, 1e-4}) {
    std::vector<Scene> scenes = {Grid(9, 9, 0.6, 0.6, {0, 8}), MeshedGrid(8, 7, 0.5, 0.5, {0}),
                                 Grid(5, 11, 0.4, 0.8, {0, 4})};
    std::vector<std::unique_ptr<ClothWorld>> alone;
    for (size_t k = 0; k < scenes.size(); ++k) {
      Touch(scenes[k]);
      scenes[k].parameters.settings.tolerance = tolerance;
      scenes[k].parameters.settings.max_iterations = tolerance > 0 ? 20 : 1;
      Stir(scenes[k], 0.5);
      for (Vector3d& p : scenes[k].state.positions_m) p.x() += 2.0 * static_cast<double>(k);
      alone.push_back(std::make_unique<ClothWorld>(backend(), 0, std::vector<Scene>{scenes[k]}));
    }
    ClothWorld world(backend(), 1, scenes);
    for (uint32_t step = 0; step < 20; ++step) {
      for (const StepReport& report : world.Step(1, true)) {
        ASSERT_EQ(report.measured.near_pairs, 0u);
      }
      std::string bits;
      for (const auto& cloth : alone) {
        cloth->Step();
        bits += cloth->Bits();
      }
      ASSERT_TRUE(world.Bits() == bits) << step;
    }
  }
}

// One with joints has one step, and a finer one more substeps: then all have.
TEST_P(Worlds, CloselyWovenAndJointedClothsStepTogether) {
  Scene fine = Grid(9, 9, 0.4, 0.4), coarse = MeshedGrid(6, 6, 0.4, 0.4);
  Touch(fine, 0.3, 40);
  Touch(coarse, 0.3, 13);
  coarse.parameters.settings.integration = Integration::kOneStep;
  for (Scene* const scene : {&fine, &coarse}) scene->parameters.colliders = {kFloor};
  Move(fine, {0, 0.05, 0});
  Move(coarse, {0.02, 0.1, 0.02});
  ClothWorld world(backend(), 1, {fine, coarse});
  const auto reports = StepWithoutCrossing(world, 40);
  for (const StepReport& report : reports) {
    EXPECT_GE(report.iterations, 40u) << "the substeps of the finer one";
    EXPECT_GT(report.measured.near_pairs, 20u);
    EXPECT_LT(report.measured.max_strain, 0.02);
  }
}

TEST_P(Worlds, AClothThatBlowsUpHoldsItsWorldAndNoOther) {
  Scene good = Grid(6, 6, 0.4, 0.4);
  Touch(good);
  Scene bad = ExplosiveSheet(6);
  bad.parameters.settings.time_step_s = good.parameters.settings.time_step_s;
  Scene elsewhere = good;
  Move(good, {0, 5, 0});
  ClothWorld world(backend(), 1, {good, bad}), other(backend(), 2, {elsewhere, elsewhere});
  std::vector<StepReport> reports;
  std::string before;
  for (uint32_t step = 0; step < 10; ++step) {
    before = world.Bits();
    std::vector<StepItem> items = world.Items();
    const std::vector<StepItem> more = other.Items();
    items.insert(items.end(), more.begin(), more.end());
    reports = backend().Step(items).reports;
    if (reports[0].fault != FaultReason::kNone) break;
  }
  EXPECT_EQ(reports[0].fault, FaultReason::kInWorld);
  EXPECT_NE(reports[1].fault, FaultReason::kNone);
  EXPECT_NE(reports[1].fault, FaultReason::kInWorld);
  EXPECT_EQ(reports[2].fault, FaultReason::kNone);
  EXPECT_TRUE(world.Bits() == before) << "the last good state is kept";
  EXPECT_EQ(world.Step()[0].fault, FaultReason::kInWorld);
}

// Sizes, places, speeds, thicknesses, steps and substeps that nothing was tuned on.
TEST_P(Worlds, RandomHeapsDoNotCross) {
  for (uint32_t seed = 1; seed < 7; ++seed) {
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::vector<Scene> scenes;
    const uint32_t substeps = std::array{10u, 20u, 52u}[seed % 3];
    const double time_step_s = std::array{1.0 / 60, 1.0 / 30, 1.0 / 100}[seed % 5 % 3];
    const double far_m = seed % 4 == 0 ? 30 : 0;  // from the origin
    const uint32_t cloths = 2 + seed % 3;
    for (uint32_t k = 0; k < cloths; ++k) {
      const auto columns = static_cast<uint32_t>(between(4, 13));
      const auto rows = static_cast<uint32_t>(between(4, 13));
      Scene scene = k % 2 == seed % 2 ? Grid(columns, rows, between(0.2, 0.6), between(0.2, 0.6))
                                      : MeshedGrid(columns, rows, between(0.2, 0.6), 0.4);
      Touch(scene, between(0, 0.6), substeps);
      TouchItself(scene);
      scene.parameters.self_collision->thickness_m = between(0.001, 0.008);
      scene.parameters.settings.time_step_s = time_step_s;
      scene.parameters.colliders = {kFloor, SphereAt(Vector3d(far_m, 0.1, 0), 0.2)};
      Turn(scene, between(-0.3, 0.3), {between(-1, 1), between(-1, 1), between(-1, 1)});
      Move(scene, {far_m + between(-0.2, 0), 0.5 + 0.4 * k, between(-0.2, 0)});
      for (Vector3d& v : scene.state.velocities_m_per_s) {
        v = Vector3d(between(-1, 1), between(-4, -2) - 2.0 * k, between(-1, 1));
      }
      scenes.push_back(std::move(scene));
    }
    SCOPED_TRACE("seed " + std::to_string(seed));
    ClothWorld world(backend(), seed, std::move(scenes));
    ASSERT_EQ(world.Crossings(), 0u);
    StepWithoutCrossing(world, static_cast<uint32_t>(1.0 / time_step_s));
  }
}

}  // namespace
}  // namespace drape::test
