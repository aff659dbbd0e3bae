// Garments keep the lengths of their cloth: irregular meshes made by rule, hung and damped. They
// stretch like woven fabric, 2000 N/m: a square metre of 0.2 kg/m^2 that hangs by its whole width
// by a thousandth, by its corners several times as much where all threads meet.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "tests/physics/physics_test.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kMaxStrain = 0.05;
constexpr double kMaxStrainP99 = 0.01;
constexpr double kStep_s = 1.0 / 60;

// REALTIME.
class GarmentTest : public PhysicsTest {
 protected:
  void ExpectLengths(const GarmentOptions& options, double duration_s) {
    for (Scene& scene : Garments(options)) {
      scene.parameters.settings.time_step_s = kStep_s;
      const auto steps = static_cast<uint32_t>(duration_s / kStep_s);
      const Measurements measured = StepAlone(backend(), Make(scene), scene, steps, true).measured;
      std::printf("[ MEASURED ] strain of %s %u on %s: max %.2f %%, p99 %.3f %%\n",
                  scene.name.c_str(), options.seed, backend_name().c_str(),
                  100 * measured.max_strain, 100 * measured.strain_p99);
      EXPECT_LE(measured.max_strain, kMaxStrain) << scene.name << " " << options.seed;
      EXPECT_LE(measured.strain_p99, kMaxStrainP99) << scene.name << " " << options.seed;
    }
  }
};

TEST_P(GarmentTest, KeepsItsLengths) {
  ExpectLengths({.seed = 1, .cell_m = 0.08}, 1);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(GarmentTest);

using GarmentLong = GarmentTest;

TEST_P(GarmentLong, KeepsItsLengthsWhereverItIs) {
  for (const uint32_t seed : {2u, 3u, 4u}) {
    ExpectLengths({.seed = seed, .cell_m = 0.05}, 4);
    const Eigen::AngleAxisd turn(0.3 * seed, Vector3d(0.3, 0.5, 0.8).normalized());
    ExpectLengths({.seed = seed,
                   .cell_m = 0.05,
                   .bending_rigidity_n_m = 1e-5,
                   .transform = {{20, 5, -30}, Eigen::Quaterniond(turn)}},
                  4);
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(GarmentLong);

}  // namespace
}  // namespace drape::test
