// Bodies on a cloth that lies on a collider: the chain of body, particles and collider holds at any
// ratio of masses (server/solver/method.md, "Bodies").
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/physics/body_scene.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;
constexpr uint32_t kSide = 17;
constexpr double kWidth = 0.4, kCell = kWidth / (kSide - 1);

class BodyOnLaid : public PhysicsBase,
                   public testing::WithParamInterface<std::tuple<std::string, int>> {
 protected:
  std::string backend_name() const override { return std::get<0>(GetParam()); }
};

// Solids of 10 g to 10 kg are put down on a sheet that lies on a floor or a box, level: they stay
// twice the thickness above it, less what a round one sinks in between the particles of a cell, and
// never rise; the floor carries the weight. What moves in a substep is g h^2; the bars allow four.
TEST_P(BodyOnLaid, StaysOnTheClothWhateverItsMass) {
  const int seed = std::get<1>(GetParam());
  std::mt19937 random(static_cast<uint32_t>(seed));
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Scene scene = Grid(kSide, kSide, kWidth, kWidth);
  scene.parameters.settings = PresetSettings(seed % 4 == 3 ? Preset::kAccurate : Preset::kRealtime);
  scene.parameters.settings.time_step_s = 1 / uniform(30, 240);
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  const double t = 0.001 * std::pow(10, uniform(0, 1));
  scene.parameters.thickness_m = t;
  for (Vector3d& p : scene.state.positions_m) p.y() += t;
  constexpr double kRadius = 0.06;
  const Vector3d centre(uniform(0.15, 0.25), kRadius + 2 * t, uniform(0.15, 0.25));
  Collider solid = SphereAt(centre, kRadius);
  if (seed % 3 == 1) solid = BoxAt(centre, {0.07, kRadius, 0.05});
  if (seed % 3 == 2) {
    solid = CapsuleBetween(centre - Vector3d(0.05, 0, 0), centre + Vector3d(0.05, 0, 0), kRadius);
  }
  solid.mass_kg = 0.01 * std::pow(1000, seed / 7.0);
  AddBody(scene, solid);
  AddBody(scene, seed % 2 == 0 ? PlaneThrough(Vector3d::Zero(), Vector3d::UnitY())
                               : BoxAt({0.2, -0.1, 0.2}, {0.4, 0.1, 0.4}));
  const ClothHandle cloth = Make(scene);
  // Between four particles, on their tops.
  const double reach = kRadius + t;
  const double sinks = seed % 3 == 1 ? 0 : reach - std::sqrt(reach * reach - kCell * kCell / 2);
  const double step_s = scene.parameters.settings.time_step_s;
  const double h = scene.parameters.settings.substep_s();
  double lowest = 1, highest = 0, on_floor = 0;
  const int steps = static_cast<int>(std::lround(0.5 / step_s));
  for (int step = 0; step < steps; ++step) {
    const StepItem item{.cloth = cloth, .pin_targets_m = {}, .impulses = true};
    const StepReport report = backend().Step({&item, 1}).reports.at(0);
    ASSERT_EQ(report.fault, FaultReason::kNone);
    const double bottom = report.bodies->at(0).motion.position_m.y() - kRadius;
    lowest = std::min(lowest, bottom);
    highest = std::max(highest, bottom);
    if (step >= steps - steps / 2) on_floor -= report.impulses->colliders[1].impulse_n_s.y();
  }
  const double carried = on_floor / (step_s * (steps / 2));
  const double weight = (MassOf(solid).mass_kg + scene.model->total_mass_kg()) * kG;
  std::printf("[ MEASURED ] %s %d: %.3g kg, t %.2g mm, bottom %.3f to %.3f t, floor %.4f of it\n",
              backend_name().c_str(), seed, MassOf(solid).mass_kg, 1e3 * t, lowest / t, highest / t,
              carried / weight);
  EXPECT_GT(lowest, 2 * t - sinks - 4 * kG * h * h);
  EXPECT_LT(highest, 2 * t + 4 * kG * h * h);
  EXPECT_NEAR(carried, weight, 0.05 * weight);
}
INSTANTIATE_TEST_SUITE_P(Backends, BodyOnLaid,
                         testing::Combine(testing::ValuesIn(OwnBackendNames()),
                                          testing::Range(0, 8)));

}  // namespace
}  // namespace drape::test
