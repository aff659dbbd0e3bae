// A sheet that hits the floor edge-on: a wave runs up with c = sqrt(K / density), K the stretch
// stiffness, behind which the sheet stands still and is shorter by v / c (momentum over the front).
// So much do fabrics strain that land, whatever the solver does.
#include <cmath>

#include "tests/physics/physics_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class Impact : public PhysicsTest {};
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Impact);

TEST_P(Impact, StrainsBySpeedOverThatOfTheWave) {
  constexpr uint32_t kColumns = 5, kRows = 65;
  constexpr double kLength_m = 1, kCell_m = kLength_m / (kRows - 1), kSpeed_m_per_s = 4;
  constexpr double kDensity = 0.2;  // of Grid [kg/m^2]
  for (const double stiffness : {2000.0, 8000.0}) {
    StructuralMaterial material;
    material.stretch_stiffness_n_per_m = stiffness;
    Scene scene = Grid(kColumns, kRows, (kColumns - 1) * kCell_m, kLength_m, {}, material);
    for (Vector3d& p : scene.state.positions_m) p = Vector3d(p.x(), p.z(), 0);
    scene.state.velocities_m_per_s.assign(kColumns * kRows, Vector3d(0, -kSpeed_m_per_s, 0));
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d::UnitY())};
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    const double wave_m_per_s = std::sqrt(stiffness / kDensity);
    // Until the front has run two thirds of the way.
    scene.parameters.settings.time_step_s = kLength_m / wave_m_per_s * 2 / 3;
    const ParticleState after = StateAfter(scene);
    const auto height_m = [&](uint32_t row) {
      return after.positions_m[row * kColumns + kColumns / 2].y();
    };
    constexpr uint32_t kFirst = 4, kLast = 36;  // behind the front
    const double window_m = (kLast - kFirst) * kCell_m;
    const double strain = (height_m(kLast) - height_m(kFirst)) / window_m - 1;
    // The front is as wide as a cell or two, and each end of the window may be off by half of a
    // cell's time.
    EXPECT_NEAR(strain, -kSpeed_m_per_s / wave_m_per_s,
                kCell_m / window_m * kSpeed_m_per_s / wave_m_per_s)
        << stiffness << " N/m";
    // What is before the front falls on.
    const double fallen_m = kSpeed_m_per_s * scene.parameters.settings.time_step_s;
    EXPECT_NEAR(height_m(kRows - 1), kLength_m - fallen_m, 0.01 * fallen_m);
  }
}

}  // namespace
}  // namespace drape::test
