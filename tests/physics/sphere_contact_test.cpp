// Spheres: the point where a particle leaves one, and the depth of a cloth's particles and edges.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class SphereSlide : public PhysicsTest {
 protected:
  static constexpr double kRadius = 1;
  static constexpr double kDuration_s = 1;

  // Starts on the sphere at the angle `start` from the top, with the speed v along it.
  Scene Sliding(double start, double speed, uint32_t substeps) {
    Scene scene = LoneParticle(kRadius * Vector3d(std::sin(start), std::cos(start), 0),
                               speed * Vector3d(std::cos(start), -std::sin(start), 0));
    scene.parameters.colliders = {SphereAt({0, 0, 0}, kRadius)};
    scene.parameters.settings = SingleSubstep(kDuration_s, 2);
    scene.parameters.settings.substeps = substeps;
    return scene;
  }
};

// Without friction m v^2 / R = m g cos a ends the contact, and v^2 = v0^2 + 2 g R (cos a0 - cos a):
// cos a = (2 cos a0 + v0^2 / gR) / 3, from the top at rest 2/3. From there on the horizontal speed
// v cos a = sqrt(gR cos^3 a) stays: so the speed at the end gives the point where it left.
//
// The projection is of first order. When it leaves is known to a substep only, in which the force
// of the contact would change by |N'|/m h with N'/m = -3 g sin a v / R: the speed is off by up to
// |N'|/m h^2, and the extrapolated one by (2/4^2 + 1/2^2) of that for the coarsest h. Rounding: the
// gap, of some 8 operations on numbers of size R, over h.
TEST_P(SphereSlide, LeavesAtTwoThirdsOfTheHeight) {
  struct Start {
    double angle;
    double speed;
  };
  for (const Start& start : {Start{0, 0.5}, Start{0.4, 0}, Start{0.2, 1.0}}) {
    const double cosine =
        (2 * std::cos(start.angle) + start.speed * start.speed / (kG * kRadius)) / 3;
    const double exact = std::sqrt(kG * kRadius * std::pow(cosine, 3));
    std::array<double, 3> speeds{};
    constexpr uint32_t kCoarse = 480;
    for (uint32_t k = 0; k < 3; ++k) {
      const Scene scene = Sliding(start.angle, start.speed, kCoarse << k);
      const ParticleState end = StateAfter(scene);
      ASSERT_GT(end.positions_m[0].norm(), 1.05 * kRadius) << "still on the sphere";
      speeds[k] = end.velocities_m_per_s[0].x();
    }
    const double h = kDuration_s / kCoarse;
    const double sine = std::sqrt(1 - cosine * cosine);
    const double force_rate = 3 * kG * sine * std::sqrt(kG * kRadius * cosine) / kRadius;
    const double uncertain = force_rate * h * h * (2.0 / 16 + 1.0 / 4);
    const double rounding = 8 * round_off() * kRadius / (h / 4);
    const Refinement refinement{speeds, 1};
    EXPECT_NEAR(refinement.limit(), exact,
                refinement.bound() + uncertain + refinement.rounding_gain() * rounding)
        << "from " << start.angle << " at " << start.speed << " m/s: " << speeds[0] << " "
        << speeds[1] << " " << speeds[2];
    std::printf("[ MEASURED ] leaving a sphere on %s: cos = %.5f, %.5f by energy\n",
                backend_name().c_str(), std::cbrt(std::pow(refinement.limit(), 2) / (kG * kRadius)),
                cosine);
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(SphereSlide);

class SpherePenetration : public PresetTest {};

// 3 cm edges at 60 Hz, falling 5 cm onto a sphere of 0.3 m. The floor is 2 mm at the particles, the
// aim 0.2 mm. Particles are projected last in every sweep; friction may take back what was
// tangential to the normal of an earlier sweep (contact_test). Contacts do not see the edges
// between the particles: the middle of an edge of length l between two points on the sphere is l^2
// / 8R inside, as the chord of an arc is.
TEST_P(SpherePenetration, OfParticlesAndOfEdges) {
  constexpr double kRadius = 0.3, kEdge = 0.03;
  constexpr uint32_t kSide = 15;
  const Vector3d center(0.22, -0.35, 0.2);
  Scene scene = Grid(kSide, kSide, kEdge * (kSide - 1), kEdge * (kSide - 1));
  scene.parameters.colliders = {SphereAt(center, kRadius)};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.settings = PresetSettings(preset());
  const ClothHandle cloth = Make(scene);
  double at_particles = 0, at_middles = 0, longest = 0;
  uint32_t contacts = 0;
  for (int step = 0; step < 27; ++step) {
    contacts = std::max(contacts, StepAlone(backend(), cloth, scene, 1, true).measured.contacts);
    const ParticleState state = ReadState(backend(), cloth);
    const auto depth = [&](const Vector3d& q) { return kRadius - (q - center).norm(); };
    for (const Vector3d& p : state.positions_m) at_particles = std::max(at_particles, depth(p));
    for (const DistanceConstraint& edge : scene.model->constraints()) {
      const Vector3d &p = state.positions_m[edge.i], &q = state.positions_m[edge.j];
      at_middles = std::max(at_middles, depth((p + q) / 2));
      longest = std::max(longest, (q - p).norm());
    }
  }
  std::printf(
      "[ MEASURED ] penetration under %s on %s: %.4f mm at particles, %.4f mm at middles of "
      "edges (chord %.4f mm)\n",
      std::string(PresetName(preset())).c_str(), backend_name().c_str(), 1e3 * at_particles,
      1e3 * at_middles, 1e3 * longest * longest / (8 * kRadius));
  EXPECT_GE(contacts, 20u) << "the sheet never lay on the sphere";
  EXPECT_LE(at_particles, 2e-4);
  // The middle of a chord whose ends are at_particles deep: sqrt((R - d)^2 - l^2/4) from the
  // centre.
  const double shallow = kRadius - at_particles;
  const double chord = kRadius - std::sqrt(shallow * shallow - longest * longest / 4);
  EXPECT_LE(at_middles, chord + 8 * round_off());
  EXPECT_NEAR(chord, at_particles + longest * longest / (8 * kRadius), 0.02 * chord);
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(SpherePenetration);

}  // namespace
}  // namespace drape::test
