// Particles that bounce off colliders.
#include <cmath>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class Restitution : public PhysicsTest {
 protected:
  static Scene OverAPlane(const Vector3d& position, const Vector3d& velocity, double restitution) {
    Scene scene = LoneParticle(position, velocity);
    scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
    scene.parameters.restitution = restitution;
    scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
    scene.parameters.settings.substeps = 10;
    return scene;
  }
};

// Heights e^(2k) h0, at any step size: flight between contacts is exact (Bender et al. 2009, eq. 1
// and 2), a hit leaves from the surface, with e times the speed that energy gives there. Rounding:
// some 12 of the speed per substep, and those of e and of the root at each hit; all enter the
// energy times the speed. Below 2 g h a particle stays.
TEST_P(Restitution, HeightsShrinkByItsSquare) {
  constexpr double kHeight = 0.5;
  for (const double restitution : {0.5, 0.8, 1.0}) {
    const Scene scene = OverAPlane(Vector3d(0, kHeight, 0), Vector3d::Zero(), restitution);
    const ClothHandle cloth = Make(scene);
    const double slowest = 3 * kG * scene.parameters.settings.substep_s();
    const double first_speed = std::sqrt(2 * kG * kHeight);
    double height = kHeight;  // of the bounce under way
    uint32_t bounces = 0;
    for (uint32_t step = 1; step <= 150; ++step) {
      StepAlone(backend(), cloth, scene);
      const ParticleState state = ReadState(backend(), cloth);
      const double speed = state.velocities_m_per_s[0].y();
      const double reached = state.positions_m[0].y() + speed * speed / (2 * kG);
      const double rounding = (step * 10 * 12 + 8) * round_off() * first_speed * first_speed / kG;
      const double next = height * restitution * restitution;
      if (restitution < 1 && reached < (height + next) / 2) {
        height = next;
        ++bounces;
      }
      if (std::sqrt(2 * kG * height) < slowest) break;
      EXPECT_NEAR(reached, height, rounding) << "e = " << restitution << ", step " << step;
    }
    if (restitution < 1) {
      EXPECT_GE(bounces, 4u);
    }
  }
}

// A hit faster than 2 g h bounces, wherever in the substep it is, and no other. One substep per
// step, so that no bounce is missed: it takes 4 e substeps. Heights that would hit within 2 % of
// the threshold prove nothing.
TEST_P(Restitution, BouncesEndAtTheSpeedThatGravityGivesInTwoSubsteps) {
  for (const double restitution : {0.6, 0.8, 0.9}) {
    for (uint32_t k = 0; k < 8; ++k) {
      const double height = 0.3 + 0.037 * k;
      Scene scene = OverAPlane(Vector3d(0, height, 0), Vector3d::Zero(), restitution);
      scene.parameters.settings = SingleSubstep(1.0 / 240, 2);
      const double slowest = 2 * kG * scene.parameters.settings.substep_s();
      double speed = std::sqrt(2 * kG * height);
      int expected = 0;
      bool is_clear = true;
      for (; speed > slowest; ++expected) {
        speed *= restitution;
        is_clear &= std::abs(speed / slowest - 1) > 0.02;
      }
      if (!is_clear) continue;
      const ClothHandle cloth = Make(scene);
      int bounces = 0;
      for (uint32_t step = 0; step < 2400; ++step) {
        StepAlone(backend(), cloth, scene);
        const ParticleState state = ReadState(backend(), cloth);
        const double v = state.velocities_m_per_s[0].y();
        const double reached = state.positions_m[0].y() + v * v / (2 * kG);
        if (reached < 1e-6 * height) break;
        bounces =
            static_cast<int>(std::lround(std::log(reached / height) / (2 * std::log(restitution))));
      }
      EXPECT_EQ(bounces, expected) << "e = " << restitution << ", from " << height << " m";
    }
  }
}

// Slow bounces end, and resting particles stay, to the bit as without restitution.
TEST_P(Restitution, BouncesEndInRest) {
  const Scene scene = OverAPlane(Vector3d(0, 0.5, 0), Vector3d::Zero(), 0.5);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 120);
  const ParticleState rest = ReadState(backend(), cloth);
  EXPECT_NEAR(rest.positions_m[0].y(), 0, 4 * round_off() * 0.5);
  EXPECT_LE(rest.velocities_m_per_s[0].norm(),
            kG * scene.parameters.settings.substep_s() * 8 * round_off());
  const std::string bits = ReadBits(backend(), cloth);
  StepAlone(backend(), cloth, scene, 1000);
  EXPECT_EQ(ReadBits(backend(), cloth), bits);
}

// v' = v - (1 + e) (v.n) n without friction; with it the tangential speed falls by mu (1 + e)
// |v.n|, Coulomb's law for the whole impulse. Roundings: some 24 of the speed, and that of the gap
// over h, which is pushed out and taken back.
TEST_P(Restitution, AHitKeepsOrRubsOffTheTangentialSpeed) {
  constexpr double kRestitution = 0.6;
  const Vector3d normal = Vector3d(0.28, 0.96, 0);
  const Vector3d tangent = Vector3d(0.96, -0.28, 0);
  const Vector3d start = 0.011 * normal;
  const Vector3d velocity = 3 * tangent - 2 * normal;
  for (const double friction : {0.0, 0.25}) {
    Scene scene = OverAPlane(start, velocity, kRestitution);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {PlaneThrough({0, 0, 0}, normal)};
    scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
    const ParticleState state = StateAfter(scene);
    const double h = scene.parameters.settings.substep_s();
    const double bound = round_off() * (24 * velocity.norm() + 8 * 0.1 / h);
    const Vector3d& after = state.velocities_m_per_s[0];
    EXPECT_NEAR(after.dot(normal), kRestitution * 2, bound);
    EXPECT_NEAR(after.dot(tangent), 3 - friction * (1 + kRestitution) * 2, bound);
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Restitution);

class RestitutionOfSheets : public PresetTest {};

// A sheet at rest does not hop, whatever its links do, because nothing approaches the collider.
TEST_P(RestitutionOfSheets, ASheetAtRestStaysAtRest) {
  std::string bits[2];
  for (const bool bounces : {false, true}) {
    Scene scene = Grid(5, 5, 0.12, 0.12);
    scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
    scene.parameters.restitution = bounces ? 0.9 : 0;
    scene.parameters.settings = PresetSettings(preset());
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 100);
    bits[bounces] = ReadBits(backend(), cloth);
  }
  EXPECT_EQ(bits[0], bits[1]);
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(RestitutionOfSheets);

}  // namespace
}  // namespace drape::test
