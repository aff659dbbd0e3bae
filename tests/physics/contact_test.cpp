// Contacts and Coulomb friction of single particles against closed forms.
#include <cmath>

#include "server/solver/solver_constants.h"
#include "tests/physics/falling_sheet.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class Contact : public PhysicsTest {};

// A surface through the origin, inclined about the z axis; downhill is (cos, -sin, 0).
struct Incline {
  explicit Incline(double angle)
      : normal(std::sin(angle), std::cos(angle), 0),
        downhill(std::cos(angle), -std::sin(angle), 0),
        plane(PlaneThrough(Vector3d::Zero(), normal)),
        box(BoxAt(-0.25 * normal, {8, 0.25, 1},
                  Eigen::Quaterniond(Eigen::AngleAxisd(-angle, Vector3d::UnitZ())))) {}
  Vector3d normal;
  Vector3d downhill;
  Collider plane;
  Collider box;  // its top is the plane
};

// Rounding of the centre and of the difference to it, both of size 0.25 m.
constexpr double kBoxRoundings_m = 4 * 0.25;

// A particle that touches the incline.
Scene BlockOn(const Incline& incline, const Collider& surface, double speed, double friction_static,
              double friction_dynamic) {
  Scene scene = LoneParticle(Vector3d::Zero(), speed * incline.downhill);
  scene.parameters.colliders = {surface};
  scene.parameters.friction_static = friction_static;
  scene.parameters.friction_dynamic = friction_dynamic;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
  scene.parameters.settings.substeps = 10;
  return scene;
}

TEST_P(Contact, AParticleAtRestOnAPlaneStays) {
  Scene scene = LoneParticle(Vector3d(0.3, -0.65, -0.2), Vector3d::Zero());
  scene.parameters.colliders = {PlaneThrough(Vector3d(0, -0.65, 0), {0, 1, 0})};
  for (const double friction : {0.0, 0.5}) {
    scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
    scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
    scene.parameters.settings.substeps = 4;
    const ClothHandle cloth = Make(scene);
    const StepReport report = StepAlone(backend(), cloth, scene, 1000, true);
    const ParticleState state = ReadState(backend(), cloth);
    // The gap is corrected against the rounded height: it never leaves by more than 2 roundings.
    EXPECT_NEAR(state.positions_m[0].y(), -0.65, 2 * 0.65 * round_off() + 0.65 * round_off());
    EXPECT_NEAR(state.positions_m[0].x(), 0.3, 0.3 * round_off());
    EXPECT_NEAR(state.positions_m[0].z(), -0.2, 0.2 * round_off());
    EXPECT_EQ(report.measured.contacts, 1u);
    EXPECT_LE(report.measured.max_penetration_m, 3 * 0.65 * round_off());
    // No hop by h^2 g / 2, and no velocity that would make one.
    EXPECT_LE(state.velocities_m_per_s[0].norm(), kG / 240 * 8 * round_off());
  }
}

// tan(20 degrees) = 0.364 < mu_s: no creep in 1000 steps. Each of the 10^4 substeps may leave 4
// roundings of the velocity that gravity gave it, g h.
TEST_P(Contact, ABlockSticksOnAnInclineBelowTheStaticFriction) {
  const Incline incline(20 * M_PI / 180);
  for (const Collider& surface : {incline.plane, incline.box}) {
    const Scene scene = BlockOn(incline, surface, 0, 0.4, 0.3);
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 1000);
    const double h = scene.parameters.settings.substep_s();
    const bool is_box = surface.kind() == ShapeKind::kBox;
    const double settling = is_box ? kBoxRoundings_m * round_off() : 0;
    EXPECT_LE(ReadState(backend(), cloth).positions_m[0].norm(),
              1e4 * 4 * round_off() * kG * h * h + settling);
  }
}

// Friction takes g sin(20 degrees) h^2 = 9e-6 m from the motion in a substep, far within this
// tolerance of 1e-3 m: it must act all the same.
TEST_P(Contact, FrictionActsBelowTheToleranceToo) {
  const Incline incline(20 * M_PI / 180);
  Scene scene = BlockOn(incline, incline.plane, 0, 0.4, 0.3);
  scene.parameters.settings.tolerance = 1e-3;
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 300);
  const double h = scene.parameters.settings.substep_s();
  EXPECT_LE(ReadState(backend(), cloth).positions_m[0].norm(), 3e3 * 4 * round_off() * kG * h * h);
}

// The same, one degree beyond: it must not stick. atan(0.4) = 21.8 degrees.
TEST_P(Contact, ABlockSlidesOnAnInclineWithTheDynamicFriction) {
  for (const double degrees : {22.8, 45.0}) {
    const double angle = degrees * M_PI / 180;
    const Incline incline(angle);
    for (const Collider& surface : {incline.plane, incline.box}) {
      const Scene scene = BlockOn(incline, surface, 0, 0.4, 0.3);
      const ClothHandle cloth = Make(scene);
      constexpr uint32_t kSteps = 60;
      StepAlone(backend(), cloth, scene, kSteps);
      const ParticleState state = ReadState(backend(), cloth);
      const double acceleration = kG * (std::sin(angle) - 0.3 * std::cos(angle));
      // Constant acceleration has no discretisation error. 600 substeps of some 12 roundings each,
      // of gravity's own g h and of the speed; the normal's rounding tilts the plane once.
      const double speed_bound = (600 * 12 + 4) * round_off() * kG;
      EXPECT_NEAR(state.velocities_m_per_s[0].dot(incline.downhill), acceleration, speed_bound);
      EXPECT_NEAR(state.positions_m[0].dot(incline.downhill), acceleration / 2, speed_bound);
      EXPECT_NEAR(state.positions_m[0].dot(incline.normal), 0, 8 * round_off() * kG);
    }
  }
}

// v^2 / (2 mu g). The last substep stops whatever static friction can hold, a speed of at most
// mu_s g h (half of it before, half after the advance): mu_s^2 g h^2 / (2 mu_d) short.
TEST_P(Contact, ASlideStopsAfterTheKnownDistanceAndStays) {
  const Incline level(0);
  for (const double speed : {0.5, 2.0}) {
    const Scene scene = BlockOn(level, level.plane, speed, 0.45, 0.4);
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 60);
    const Vector3d stopped = ReadState(backend(), cloth).positions_m[0];
    const double h = scene.parameters.settings.substep_s();
    const double distance = speed * speed / (2 * 0.4 * kG);
    const double early = 0.45 * 0.45 * kG * h * h / (2 * 0.4);
    const double rounding = (600 * 12 + 4) * round_off() * speed;
    EXPECT_NEAR(stopped.x(), distance, early + rounding);
    StepAlone(backend(), cloth, scene, 60);
    EXPECT_EQ(ReadState(backend(), cloth).positions_m[0].x(), stopped.x());
  }
}

TEST_P(Contact, WithoutFrictionASlideGoesOn) {
  const Incline level(0);
  const Scene scene = BlockOn(level, level.plane, 1, 0, 0);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 60);
  const ParticleState state = ReadState(backend(), cloth);
  EXPECT_NEAR(state.positions_m[0].x(), 1, 600 * 4 * round_off());
  EXPECT_NEAR(state.velocities_m_per_s[0].x(), 1, 600 * 4 * round_off());
}

// The projection on a sphere is exact along the line through its centre, and last in a sweep.
// Friction comes after it: it moves along the tangent, which leads outwards, but it removes part of
// an earlier sweep's change, which was tangential to the earlier normal. Within a substep a
// particle of speed v slides at most v h, and its normal turns by at most v h / r.
TEST_P(Contact, NothingFallsIntoASphere) {
  const Vector3d center(0.05, -0.4, -0.03);
  constexpr double kRadius = 0.3;
  for (const double friction : {0.0, 0.5}) {
    SCOPED_TRACE("friction " + std::to_string(friction));
    const Scene scene = CentredSheet(7, 0.6, friction, SphereAt(center, kRadius));
    const double h = scene.parameters.settings.substep_s();
    const auto depth = [&](const Vector3d& p) { return kRadius - (p - center).norm(); };
    const auto check = [&](const WatchedStep& step) {
      // Distances below 1 m: the gap is made of some 8 rounded operations, the advance of 2 more.
      // Within kTouchRoundOffs of the coordinates, 2 m in all, a particle rests where it is.
      const double way = step.speed_m_per_s * h;
      const double turning = friction == 0 ? 0 : way * way / kRadius;
      EXPECT_LE(step.deepest_m, turning + (10 + 2 * kTouchRoundOffs) * round_off());
      EXPECT_NEAR(step.reported_m, step.deepest_m, 8 * round_off());
    };
    EXPECT_GE(WatchFall(backend(), Make(scene), scene, 40, depth, check), 3u)
        << "the sheet never lay on the sphere";
  }
}

TEST_P(Contact, ThicknessKeepsTheParticleAway) {
  Scene scene = LoneParticle(Vector3d(0, 0.2, 0), Vector3d::Zero());
  scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  scene.parameters.thickness_m = 0.0625;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 120);
  EXPECT_NEAR(ReadState(backend(), cloth).positions_m[0].y(), 0.0625, 4 * round_off() * 0.0625);
}

// A deep start comes out at kMaxDepenetrationSpeed_m_per_s, 1 m/s, not at depth / h, and is
// not thrown off the surface.
TEST_P(Contact, WhatStartsDeepInsideComesOutSlowly) {
  Scene scene = LoneParticle(Vector3d(0, -0.25, 0), Vector3d::Zero());
  scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  scene.parameters.settings = SingleSubstep(1.0 / 64);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 8);
  const double after_an_eighth = ReadState(backend(), cloth).positions_m[0].y();
  EXPECT_NEAR(after_an_eighth, -0.25 + 0.125, 8 * 4 * round_off());
  StepAlone(backend(), cloth, scene, 120);
  // It left with at most 1 m/s, flew at most 5.1 cm high and is back after 0.21 s.
  EXPECT_NEAR(ReadState(backend(), cloth).positions_m[0].y(), 0, 4 * round_off());
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Contact);

}  // namespace
}  // namespace drape::test
