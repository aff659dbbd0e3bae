// Starts that have no direction, no volume or no room: never a NaN, never a fault.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr uint32_t kSide = 12;
constexpr Preset kPresets[] = {Preset::kPaper, Preset::kRealtime};

class DegenerateStartTest : public testing::TestWithParam<std::string> {
 protected:
  // Half a second with each preset.
  void ExpectSurvives(Scene scene, uint32_t steps = 30) {
    Backend& backend = SharedBackend(GetParam());
    for (const Preset preset : kPresets) {
      SCOPED_TRACE(PresetName(preset));
      scene.parameters.settings = PresetSettings(preset);
      const ClothHandle cloth = CreateCloth(backend, scene);
      const StepReport report = StepAlone(backend, cloth, scene, steps, true);
      EXPECT_EQ(report.fault, FaultReason::kNone) << FaultReasonText(report.fault);
      EXPECT_TRUE(IsFinite(ReadState(backend, cloth)));
      EXPECT_TRUE(std::isfinite(report.measured.max_strain));
      backend.Destroy(cloth);
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, DegenerateStartTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(ReductionLong, DegenerateStartTest, testing::Values("gl_reduction"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

Scene HungSheet() {
  return Grid(kSide, kSide, 1, 1, {0, kSide - 1});
}

TEST_P(DegenerateStartTest, AllParticlesAtOnePoint) {
  Scene scene = HungSheet();
  for (Vector3d& p : scene.state.positions_m) p.setZero();
  ExpectSurvives(scene);
}

TEST_P(DegenerateStartTest, AllParticlesOnOneLine) {
  Scene scene = HungSheet();
  for (Vector3d& p : scene.state.positions_m) p.z() = 0;
  ExpectSurvives(scene);
}

TEST_P(DegenerateStartTest, FoldedOntoItself) {
  Scene scene = HungSheet();
  for (Vector3d& p : scene.state.positions_m) p.z() = p.z() > 0.5 ? 1 - p.z() : p.z();
  ExpectSurvives(scene);
}

TEST_P(DegenerateStartTest, CompressedToHalf) {
  Scene scene = HungSheet();
  for (Vector3d& p : scene.state.positions_m) p *= 0.5;
  ExpectSurvives(scene);
}

TEST_P(DegenerateStartTest, StretchedToDouble) {
  Scene scene = HungSheet();
  for (Vector3d& p : scene.state.positions_m) p *= 2;
  ExpectSurvives(scene);
}

// A particle at the centre of the sphere has no way out that is nearer than another.
TEST_P(DegenerateStartTest, AtASpheresCentre) {
  Scene scene = Grid(5, 5, 0.2, 0.2);
  scene.parameters.colliders = {SphereAt(scene.state.positions_m[12], 0.5)};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  ExpectSurvives(scene);
}

// Comes out of the collider no faster than kMaxDepenetrationSpeed_m_per_s
// (server/solver/method.md).
TEST_P(DegenerateStartTest, InsideAColliderComesOutSlowly) {
  Scene scene = Particles({{{0, 0, 0}}, {1}, {}, {}});
  scene.parameters.colliders = {PlaneThrough(Vector3d(0, 0.25, 0), Vector3d::UnitY())};
  scene.parameters.gravity_m_per_s2.setZero();
  ExpectSurvives(scene);

  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  double last_height_m = 0;
  const double step_m = 1.0 / 60;  // at 1 m/s
  const double rounding_m =
      60 * 0.25 * 0x1p-24 * 4;  // per substep of the gap, the impulse, u and p
  for (int step = 0; step < 15; ++step) {
    StepAlone(backend, cloth, scene);
    const double height_m = ReadState(backend, cloth).positions_m[0].y();
    EXPECT_LE(height_m, last_height_m + step_m + rounding_m);
    last_height_m = height_m;
  }
  // 15 steps at 1 m/s are exactly the 0.25 m that it has to go.
  EXPECT_NEAR(last_height_m, 0.25, 15 * rounding_m);
  backend.Destroy(cloth);
}

TEST_P(DegenerateStartTest, SheetThroughASphere) {
  Scene scene = FallingOnSphere(kSide);
  scene.parameters.colliders.push_back(SphereAt(Vector3d(0.5, 0, 0.5), 0.3));
  ExpectSurvives(scene);
}

}  // namespace
}  // namespace drape::test
