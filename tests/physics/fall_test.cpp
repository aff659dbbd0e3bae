// Sheets that fall from far onto what has friction come to lie with the lengths that they should
// have: friction holds no strain of the impact.
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// A square sheet of 1 m, turned a little, 5 to 30 m above a ball or a box over a floor.
Scene RandomFall(uint32_t seed) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
  };
  const auto side = static_cast<uint32_t>(12 + 4 * (random() % 3));
  Scene scene = Grid(side, side, 1, 1);
  const Vector3d middle(between(-0.1, 0.1), between(5, 30), between(-0.1, 0.1));
  const Vector3d axis = Vector3d(between(-1, 1), 1, between(-1, 1)).normalized();
  const Eigen::AngleAxisd turn(between(0, 0.3), axis);
  for (Vector3d& p : scene.state.positions_m) p = turn * (p - Vector3d(0.5, 0, 0.5)) + middle;
  ClothParameters& parameters = scene.parameters;
  parameters.friction_static = between(0.2, 1.2);
  parameters.friction_dynamic = parameters.friction_static * between(0.4, 1);
  parameters.thickness_m = 0.005;
  parameters.damping_per_s = 0.5;
  const Collider solid = seed % 2 == 0 ? SphereAt(Vector3d::Zero(), 0.3)
                                       : BoxAt(Vector3d::Zero(), Vector3d(0.25, 0.25, 0.25));
  parameters.colliders = {solid, PlaneThrough(Vector3d(0, -0.6, 0), Vector3d::UnitY())};
  return scene;
}

class Fall : public PresetTest {
 protected:
  // Four seconds after it has reached the floor at the latest.
  Measurements AtRest(uint32_t seed) {
    Scene scene = RandomFall(seed);
    scene.parameters.settings = PresetSettings(preset());
    scene.parameters.settings.time_step_s = seed % 3 == 0 ? 1.0 / 30 : 1.0 / 60;
    if (seed % 2 == 1) {
      scene.parameters.settings.collider_contact = ColliderContact::kSurface;
    }
    const ClothHandle cloth = Make(scene);
    const double fall_s = std::sqrt(2 * 31.6 / 9.81);
    const auto steps = static_cast<uint32_t>((fall_s + 4) / scene.parameters.settings.time_step_s);
    const StepReport report = StepAlone(backend(), cloth, scene, steps, true);
    EXPECT_EQ(report.fault, FaultReason::kNone) << "seed " << seed;
    return report.measured;
  }

  // 1 %, the promise of REALTIME for cloths that hang by points. What friction can hold of a link
  // of l by the weight of its ends is 2 mu g h^2 / l of strain, here at most 0.03 %. Where
  // particles alone touch, links over an edge of a box may exceed that, because their own tension
  // presses their ends against the faces; so boxes are touched by edges, too, where the backend can
  // (server/solver/presets.md).
  void ExpectNoStrain(uint32_t first_seed, uint32_t count) {
    for (uint32_t seed = first_seed; seed < first_seed + count; ++seed) {
      const Measurements measured = AtRest(seed);
      std::printf("[ MEASURED ] strain after fall %u, %s on %s: %.3f %%, RMS %.3f %%\n", seed,
                  std::string(PresetName(preset())).c_str(), backend_name().c_str(),
                  1e2 * measured.max_strain, 1e2 * measured.rms_strain);
      EXPECT_LE(measured.max_strain, 0.01) << "seed " << seed;
    }
  }
};

TEST_P(Fall, LeavesNoStrain) {
  ExpectNoStrain(1, 4);
}

// PAPER's one substep of 1/60 s does lock strain in (server/solver/presets.md).
INSTANTIATE_TEST_SUITE_P(
    Presets, Fall, testing::Combine(testing::Values("cpu"), testing::Values(Preset::kRealtime)),
    [](const auto& test) {
      return std::get<0>(test.param) + "_" + std::string(PresetName(std::get<1>(test.param)));
    });

using FallLong = Fall;

TEST_P(FallLong, LeavesNoStrain) {
  ExpectNoStrain(10, 24);
}

INSTANTIATE_TEST_SUITE_P(Presets, FallLong,
                         testing::Combine(testing::Values("cpu", "reference", "gl"),
                                          testing::Values(Preset::kRealtime)),
                         [](const auto& test) {
                           return std::get<0>(test.param) + "_" +
                                  std::string(PresetName(std::get<1>(test.param)));
                         });

}  // namespace
}  // namespace drape::test
