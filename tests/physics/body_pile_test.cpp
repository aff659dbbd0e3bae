// Columns of solids that fall onto each other: contacts of many bodies at once, some of which
// contradict each other (server/solver/bodies/contact_problem.h).
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/physics/body_scene.h"

namespace drape::test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Whatever wedges what, no step adds energy, but for what flight and turns about points that stick
// leave to second order in the turn of a substep, in each of them (rigid_body_test).
class BodyPile : public BodyTest {
 protected:
  void Fall(uint32_t seed) {
    std::mt19937 random(seed);
    const auto any = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto vector = [&](double low, double high) {
      const double x = any(low, high), y = any(low, high);
      return Vector3d(x, y, any(low, high));
    };
    Scene scene = Nothing();
    scene.parameters.friction_static = any(0, 1);
    scene.parameters.friction_dynamic = any(0.5, 1) * scene.parameters.friction_static;
    scene.parameters.restitution = seed % 3 == 0 ? 0.5 : 0;
    const auto solids = static_cast<int>(4 + random() % 4);
    for (int k = 0; k < solids; ++k) {
      const Vector3d half = vector(0.03, 0.08);
      const Vector3d centre(any(-0.05, 0.05), 0.12 + 0.2 * k, any(-0.05, 0.05));
      Collider solid;
      switch (random() % 3) {
        case 0:
          solid.shape = CapsuleShape{centre - half.x() * Vector3d(1, 0, 0.2), centre, 0.03};
          break;
        case 1:
          solid.shape = CylinderShape{centre, centre + half, 0.05};
          break;
        default: {
          const Vector3d axis = vector(-1, 1);
          solid = BoxAt(centre, half,
                        Quaterniond(any(0.1, 1), axis.x(), axis.y(), axis.z()).normalized());
        }
      }
      solid.mass_kg = std::exp(any(-2, 2));
      AddBody(scene, solid, Vector3d::Zero(), vector(-3, 3));
    }
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
    const ClothHandle cloth = Make(scene);
    double energy = 0, scale = 0, most_gain = 0;
    for (int step = 0; step < 70; ++step) {
      Step(cloth, scene);
      const double now = EnergyOfBodies(scene, report_), gain = now - energy;
      if (step == 0) scale = now;
      double fastest = 0;
      for (const BodyState& state : *report_.bodies) {
        fastest = std::max(fastest, state.motion.angular_velocity_rad_per_s.norm());
      }
      const double turn = fastest * scene.parameters.settings.substep_s();
      if (step > 0) {
        most_gain = std::max(most_gain, gain / scale);
        ASSERT_LE(gain, scale * (scene.parameters.settings.substeps * turn * turn + 1e-9))
            << "seed " << seed << ", step " << step;
      }
      energy = now;
    }
    std::printf("[ MEASURED ] %s, pile %u of %d: largest gain of a step %.2g of the energy\n",
                backend_name().c_str(), seed, solids, most_gain);
  }
};
class BodyPileLong : public BodyPile {};

// In the pile of 50 contacts that were not settled made one and a half times the energy, once.
TEST_P(BodyPile, GainsNothing) {
  for (const uint32_t seed : {2u, 50u}) ASSERT_NO_FATAL_FAILURE(Fall(seed));
}

TEST_P(BodyPileLong, GainsNothing) {
  for (uint32_t seed = 0; seed < 60; ++seed) ASSERT_NO_FATAL_FAILURE(Fall(seed));
}

INSTANTIATE_TEST_SUITE_P(Backends, BodyPile, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(Backends, BodyPileLong, testing::Values("cpu"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

}  // namespace
}  // namespace drape::test
