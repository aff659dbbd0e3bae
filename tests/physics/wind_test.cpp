// Drag and lift of the air (server/solver/method.md, apply_wind) against closed forms.
#include <cmath>
#include <utility>
#include <vector>

#include "server/solver/solver_constants.h"
#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kDensity_kg_per_m2 = 0.2;
constexpr double kDrag = 1.2;
// dv/dt = -c v^2 of a sheet that the air meets broadside [1/m].
constexpr double kDecay_per_m = kAirDensity_kg_per_m3 * kDrag / (2 * kDensity_kg_per_m2);

// A square of 1 m of side x side particles in the xz plane: a grid, whose particles weigh the same.
Scene GridSheet(uint32_t columns, uint32_t rows) {
  ModelDescription description;
  description.topology =
      GridTopology{.columns = columns, .rows = rows, .width_m = 1, .height_m = 1};
  description.material.areal_density_kg_per_m2 = kDensity_kg_per_m2;
  Scene scene;
  scene.name = "grid";
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  scene.parameters.air_drag = kDrag;
  return scene;
}

// The same as a mesh, turned about z: its particles weigh what their triangles do.
Scene Sheet(uint32_t side, double angle_rad = 0) {
  TriangleMesh mesh;
  for (uint32_t row = 0; row < side; ++row) {
    for (uint32_t column = 0; column < side; ++column) {
      const double x = column / (side - 1.0);
      mesh.positions_m.push_back(
          {x * std::cos(angle_rad), x * std::sin(angle_rad), row / (side - 1.0)});
      if (row + 1 == side || column + 1 == side) continue;
      const uint32_t corner = row * side + column;
      mesh.triangles.push_back({corner, corner + side, corner + 1});
      mesh.triangles.push_back({corner + 1, corner + side, corner + side + 1});
    }
  }
  Scene scene;
  scene.name = "sheet";
  scene.model =
      BuildModel({mesh, {.areal_density_kg_per_m2 = kDensity_kg_per_m2}, /*pinned_particles=*/{}});
  scene.state = RestState(*scene.model);
  scene.parameters.air_drag = kDrag;
  return scene;
}

Scene WeightlessSheet(uint32_t side, const Vector3d& wind_m_per_s, double angle_rad = 0) {
  Scene scene = Sheet(side, angle_rad);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.wind_m_per_s = wind_m_per_s;
  return scene;
}

class Wind : public PhysicsTest {};

// Without other forces the relative velocity of a sheet broadside to the wind decays as w / (1 + c
// w t), which is what a kick does: exact at any step size and resolution. 40 roundings per substep
// of numbers up to w.
TEST_P(Wind, BroadsideDragIsExactAtAnyStepSize) {
  const Vector3d wind(0, 3, 0);
  struct Case {
    uint32_t side, substeps, steps;
  };
  for (const auto [side, substeps, steps] : {Case{3, 1, 1}, Case{5, 1, 30}, Case{9, 20, 6}}) {
    Scene scene = WeightlessSheet(side, wind);
    scene.parameters.settings = SingleSubstep(1.0 / 30);
    scene.parameters.settings.substeps = substeps;
    const ParticleState state = StateAfter(scene, steps);
    const double speed = 3 - 3 / (1 + kDecay_per_m * 3 * steps / 30);
    for (const Vector3d& v : state.velocities_m_per_s) {
      EXPECT_NEAR(v.y(), speed, 40 * substeps * steps * round_off() * 3);
      EXPECT_LE(std::hypot(v.x(), v.z()), 40 * substeps * steps * round_off() * 3);
    }
  }
}

// v = v_t tanh(g t / v_t), v_t = sqrt(2 m g / (rho C A)). Drag and gravity act one after the other
// (Strang splitting): the leading term of the error is at most h^2 c g^2 / 4 per second, where v <
// v_t bounds every commutator of the two by 2 c g^2; the path adds the rule's h^2 / 12 of |v''| < c
// v_t g. A second order scheme: half the step, a quarter of the error.
TEST_P(Wind, AFallingSheetReachesItsTerminalVelocity) {
  constexpr double kG = 9.81;
  const double terminal = std::sqrt(kG / kDecay_per_m);
  double previous_error = 0;
  for (const uint32_t rate : {30u, 60u, 120u}) {
    Scene scene = Sheet(5);
    scene.parameters.settings = SingleSubstep(1.0 / rate);
    const double h = 1.0 / rate;
    for (const uint32_t quarters : {1u, 2u, 4u, 12u}) {
      SCOPED_TRACE(std::to_string(rate) + " Hz");
      const double t = quarters / 4.0;
      const ParticleState state = StateAfter(scene, rate * quarters / 4);
      const double phase = kG * (rate * quarters / 4) * h / terminal;
      const double v_bound = t * h * h * kDecay_per_m * kG * kG / 4 + 1e-5;
      const double p_bound = t * (v_bound + h * h * kDecay_per_m * terminal * kG / 12) + 1e-5;
      const double v_error =
          std::abs(state.velocities_m_per_s[7].y() + terminal * std::tanh(phase));
      EXPECT_LE(v_error, v_bound) << t << " s";
      EXPECT_NEAR(state.positions_m[7].y(), -terminal * terminal / kG * std::log(std::cosh(phase)),
                  p_bound)
          << t << " s";
      if (quarters != 2 || rate == 30) continue;
      if (rate == 120) {
        EXPECT_GT(previous_error / v_error, 3) << "second order";
      }
      previous_error = v_error;
    }
  }
}

// The air takes a grid along as one piece too, its rim and corners included: all of it falls as a
// mesh does, whose fall the test above knows.
TEST_P(Wind, AFlatGridFallsAsOnePiece) {
  constexpr uint32_t kSteps = 90;
  Scene mesh = Sheet(5);
  mesh.parameters.settings = SingleSubstep(1.0 / 60);
  const double y = StateAfter(mesh, kSteps).positions_m[12].y();
  for (const auto& [columns, rows] : {std::pair{2u, 2u}, {9u, 5u}, {16u, 16u}}) {
    Scene scene = GridSheet(columns, rows);
    scene.parameters.settings = SingleSubstep(1.0 / 60);
    const ParticleState state = StateAfter(scene, kSteps);
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      const double fallen = state.positions_m[i].y() - scene.state.positions_m[i].y();
      EXPECT_NEAR(fallen, y, 40 * kSteps * round_off() * std::abs(y)) << i;
    }
  }
}

// Meshes of one sheet fall in the same way, to the rounding of 40 operations per substep.
TEST_P(Wind, FinerMeshesFallAlike) {
  constexpr uint32_t kSteps = 60;
  std::vector<double> heights, speeds;
  for (const uint32_t side : {3u, 9u, 17u}) {
    Scene scene = Sheet(side);
    scene.parameters.settings = SingleSubstep(1.0 / 60);
    const ParticleState state = StateAfter(scene, kSteps);
    heights.push_back(state.positions_m[side + 1].y());
    speeds.push_back(state.velocities_m_per_s[side + 1].y());
  }
  const double bound = 40 * kSteps * round_off() * 2;
  for (size_t k = 1; k < heights.size(); ++k) {
    EXPECT_NEAR(speeds[k], speeds[0], bound);
    EXPECT_NEAR(heights[k], heights[0], bound);
  }
}

// The force on a grid is rho/2 C A w^2 at any resolution; the limit of a kick takes off at most the
// share h c w / 2 of it for the lightest triangles, which weigh at least half their area.
TEST_P(Wind, TheForceOnAGridDoesNotDependOnItsResolution) {
  constexpr double kStep_s = 1e-4, kWind = 3;
  const double force = kAirDensity_kg_per_m3 / 2 * kDrag * 0.5 * kWind * kWind;
  for (const uint32_t side : {2u, 7u, 24u}) {
    Scene scene = Grid(side, side, 1, 0.5);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.wind_m_per_s = {0, -kWind, 0};
    scene.parameters.air_drag = kDrag;
    scene.parameters.settings = SingleSubstep(kStep_s);
    const ParticleState state = StateAfter(scene, 1);
    double momentum = 0;
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      momentum += scene.model->masses_kg()[i] * state.velocities_m_per_s[i].y();
    }
    EXPECT_NEAR(momentum, -force * kStep_s, force * kStep_s * 4 * kStep_s * kDecay_per_m * kWind);
  }
}

TEST_P(Wind, EdgeOnThereIsNoForce) {
  Scene scene = WeightlessSheet(5, {4, 0, -3});
  scene.parameters.air_lift = 1;
  for (const Vector3d& v : StateAfter(scene, 2).velocities_m_per_s) EXPECT_EQ(v, Vector3d::Zero());
}

// A sheet that rises along the wind is hit from above and pushed down. Lift is rho/2 C A w^2 sin
// cos of the angle between wind and normal and turns the relative velocity without changing its
// length, so after one step of ratio x of the speed it lost x^2 / 2 along the wind.
TEST_P(Wind, LiftIsPerpendicularToTheWind) {
  constexpr double kAngle_rad = 0.5, kWind = 5, kStep_s = 1e-3;
  for (const double sign : {1.0, -1.0}) {
    Scene scene = WeightlessSheet(3, {sign * kWind, 0, 0}, kAngle_rad);
    scene.parameters.air_drag = 0;
    scene.parameters.air_lift = 1;
    scene.parameters.settings = SingleSubstep(kStep_s);
    const ParticleState state = StateAfter(scene, 1);
    const double x = kStep_s * kAirDensity_kg_per_m3 / (2 * kDensity_kg_per_m2) * kWind;
    const double lift = x * kWind * std::sin(kAngle_rad) * std::cos(kAngle_rad);
    for (const Vector3d& v : state.velocities_m_per_s) {
      EXPECT_NEAR(v.y(), -sign * lift, 2 * x * lift);
      EXPECT_LE(std::abs(v.x()), x * lift);
      EXPECT_LE(std::abs(v.z()), 1e-6 * lift);
    }
  }
}

// However strong, the air never blows a sheet faster than itself, nor through to its other side.
TEST_P(Wind, NeverReversesTheRelativeVelocity) {
  for (const double angle_rad : {0.0, 0.3, 1.2}) {
    for (const double lift : {0.0, kMaxAirCoefficient}) {
      Scene scene = WeightlessSheet(5, {0, 1000, 0}, angle_rad);
      scene.parameters.air_drag = kMaxAirCoefficient;
      scene.parameters.air_lift = lift;
      scene.parameters.settings = SingleSubstep(1.0 / 60);
      const ParticleState state = StateAfter(scene, 3);
      const Vector3d n(-std::sin(angle_rad), std::cos(angle_rad), 0);
      for (const Vector3d& v : state.velocities_m_per_s) {
        const Vector3d relative = scene.parameters.wind_m_per_s - v;
        EXPECT_LE(relative.norm(), 1000);
        EXPECT_GE(relative.dot(n), -1000 * 40 * round_off());
      }
    }
  }
}

// A cloth held by an edge in a storm, with the largest coefficients and the longest substeps.
TEST_P(Wind, AStormBlowsNothingUp) {
  for (const Preset preset : {Preset::kPaper, Preset::kRealtime}) {
    for (const double coefficient : {1.0, kMaxAirCoefficient}) {
      Scene scene = Grid(8, 8, 1, 1, {0, 1, 2, 3, 4, 5, 6, 7});
      scene.parameters.wind_m_per_s = {300, 100, 950};
      scene.parameters.air_drag = scene.parameters.air_lift = coefficient;
      scene.parameters.settings = PresetSettings(preset);
      const ClothHandle cloth = Make(scene);
      for (int step = 0; step < 30; ++step) {
        const StepReport report = StepAlone(backend(), cloth, scene, 1);
        ASSERT_EQ(report.fault, FaultReason::kNone) << PresetName(preset) << ", step " << step;
      }
      // The wind's speed, and what constraints and contacts may redirect of it.
      for (const Vector3d& v : ReadState(backend(), cloth).velocities_m_per_s) {
        EXPECT_LT(v.norm(), 2000);
      }
    }
  }
}

TEST_P(Wind, WithoutDragAndLiftTheWindChangesNoBit) {
  std::vector<std::string> bits;
  for (const Vector3d& wind : {Vector3d(0, 0, 0), Vector3d(5, 1, -2)}) {
    Scene scene = CompliantSheet(9, 1e-4);
    Stir(scene, 1);
    scene.parameters.wind_m_per_s = wind;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 3);
    bits.push_back(ReadBits(backend(), cloth));
  }
  EXPECT_EQ(bits[0], bits[1]);
}

TEST_P(Wind, ClothsWithoutTrianglesFeelNoAir) {
  std::vector<std::string> bits;
  for (const double coefficient : {0.0, 2.0}) {
    Scene scene = Net(5, 0.2, 1e-4);
    scene.parameters.wind_m_per_s = {5, 1, -2};
    scene.parameters.air_drag = scene.parameters.air_lift = coefficient;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 3);
    bits.push_back(ReadBits(backend(), cloth));
  }
  EXPECT_EQ(bits[0], bits[1]);
}

// Calm, then wind one way, then the other, then vacuum: each part follows its own closed form.
TEST_P(Wind, ChangesWhileTheClothRuns) {
  Scene scene = WeightlessSheet(5, {0, 0, 0});
  const auto write = [&](ClothHandle cloth) {
    ClothUpdate update;
    update.parameters = scene.parameters;
    EXPECT_TRUE(backend().Write(cloth, update).ok());
  };
  scene.parameters.air_drag = 0;
  scene.parameters.settings = SingleSubstep(1.0 / 60);
  const ClothHandle cloth = Make(scene);
  double speed = 0;
  for (const double wind : {0.0, 4.0, -6.0}) {
    scene.parameters.wind_m_per_s.y() = wind;
    scene.parameters.air_drag = kDrag;
    write(cloth);
    StepAlone(backend(), cloth, scene, 30);
    const double relative = wind - speed;
    speed = wind - relative / (1 + kDecay_per_m * std::abs(relative) * 0.5);
    for (const Vector3d& v : ReadState(backend(), cloth).velocities_m_per_s) {
      EXPECT_NEAR(v.y(), speed, 40 * 90 * round_off() * 10);
    }
  }
  scene.parameters.air_drag = 0;
  write(cloth);
  const ParticleState before = ReadState(backend(), cloth);
  StepAlone(backend(), cloth, scene, 5);
  EXPECT_EQ(ReadState(backend(), cloth).velocities_m_per_s[7], before.velocities_m_per_s[7]);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Wind);

}  // namespace
}  // namespace drape::test
