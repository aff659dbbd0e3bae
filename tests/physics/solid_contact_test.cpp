// Sheets and particles on boxes, capsules and cylinders.
#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"
#include "tests/physics/falling_sheet.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class SolidContact : public PhysicsTest {};

// Above its face a box is the plane of that face. With the centre at height 0 both distances are
// the same operations, so a sheet that falls askew, slides and comes to rest has the same bits.
TEST_P(SolidContact, TheTopOfABoxIsAPlane) {
  const auto settle = [this](const Collider& collider) {
    Scene scene = CentredSheet(7, 0.6, 0.4, collider);
    for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
      Vector3d& p = scene.state.positions_m[i];
      p.y() = 0.3 + 0.1 * p.x();
      scene.state.velocities_m_per_s[i] = Vector3d(0.5, 0, -0.25);
    }
    const ClothHandle cloth = Make(scene);
    const StepReport report = StepAlone(backend(), cloth, scene, 240, true);
    EXPECT_EQ(report.measured.contacts, scene.model->particle_count());
    return ReadState(backend(), cloth);
  };
  const ParticleState on_box = settle(BoxAt({0, 0, 0}, {1, 0.25, 1}));
  const ParticleState on_plane = settle(PlaneThrough({0, 0.25, 0}, {0, 1, 0}));
  EXPECT_EQ(on_box.positions_m, on_plane.positions_m);
  EXPECT_EQ(on_box.velocities_m_per_s, on_plane.velocities_m_per_s);
}

// On a box anywhere, turned anyhow about the vertical: no drift in 1000 steps.
TEST_P(SolidContact, AParticleAtRestOnABoxStays) {
  Scene scene = LoneParticle(Vector3d(0.3, -0.65, -0.2), Vector3d::Zero());
  scene.parameters.colliders = {
      BoxAt({0.1, -1.05, 0.2}, {0.7, 0.4, 0.6},
            Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d::UnitY())))};
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.5;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
  scene.parameters.settings.substeps = 4;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 1000, true);
  const ParticleState state = ReadState(backend(), cloth);
  // The height of the top is the sum of rounded numbers below 1.05, the particle's one more.
  EXPECT_NEAR(state.positions_m[0].y(), -0.65, 4 * 1.05 * round_off());
  EXPECT_NEAR(state.positions_m[0].x(), 0.3, 0.3 * round_off());
  EXPECT_NEAR(state.positions_m[0].z(), -0.2, 0.2 * round_off());
  EXPECT_EQ(report.measured.contacts, 1u);
  EXPECT_LE(report.measured.max_penetration_m, 4 * 1.05 * round_off());
  EXPECT_LE(state.velocities_m_per_s[0].norm(), kG / 240 * 8 * round_off());
}

// Without weight, a thick particle is pushed out by thickness - distance along the normal, however
// deep it is, within one step of a second. 16 cloths in one batch, so that the cpu backend has them
// side by side; the first is stepped alone, too.
TEST_P(SolidContact, ACylinderPushesByItsExactDistance) {
  const Vector3d a(-0.4, -0.2, 0.1), b(0.3, 0.25, -0.2);
  constexpr double kRadius = 0.25, kThickness = 0.5;
  constexpr uint32_t kCloths = 16, kParticles = 50;
  Random random(11);
  std::vector<Vector3d> starts;
  while (starts.size() < kCloths * kParticles) {
    const Vector3d p = PointInBox(random, Vector3d::Constant(-0.8), Vector3d::Constant(0.8));
    const CylinderPlace exact = PlaceAtCylinder(a, b, kRadius, p);
    const bool is_kinked = exact.distance < 0 && exact.lead < 1e-3;
    if (exact.distance > kThickness || std::abs(exact.distance) < 1e-3 || is_kinked) continue;
    starts.push_back(p.cast<float>().cast<double>());
  }
  Scene scene = Particles({.positions_m = std::vector(starts.begin(), starts.begin() + kParticles),
                           .masses_kg = std::vector<double>(kParticles, 0.1),
                           .distance_constraints = {},
                           .springs = {}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.colliders = {CylinderBetween(a, b, kRadius)};
  scene.parameters.thickness_m = kThickness;
  scene.parameters.settings = SingleSubstep(1);
  std::vector<StepItem> items;
  for (uint32_t cloth = 0; cloth < kCloths; ++cloth) {
    const auto first = starts.begin() + cloth * kParticles;
    scene.state.positions_m.assign(first, first + kParticles);
    items.push_back({Make(scene), {}, false});
  }
  backend().Step(items);
  scene.state.positions_m.assign(starts.begin(), starts.begin() + kParticles);
  EXPECT_EQ(StateAfter(scene).positions_m, ReadState(backend(), items[0].cloth).positions_m);
  // The distance is off by some 16 roundings of lengths below 1.5 m, the direction by that over the
  // distance, which is at least 1e-3 m, and takes the particle up to 0.75 m along.
  const double rounding = 16 * 1.5 * round_off();
  int counts[3] = {};  // inside; outside side or end; beyond the rim
  for (uint32_t k = 0; k < starts.size(); ++k) {
    const ParticleState state = ReadState(backend(), items[k / kParticles].cloth);
    const CylinderPlace exact = PlaceAtCylinder(a, b, kRadius, starts[k]);
    const Vector3d way = state.positions_m[k % kParticles] - starts[k];
    const Vector3d expected = (kThickness - exact.distance) * exact.outward;
    const double along = std::abs(exact.outward.dot((b - a).normalized()));
    const bool is_at_rim = exact.distance > 0 && along > 0.01 && along < 0.99;
    ++counts[exact.distance < 0 ? 0 : is_at_rim ? 2 : 1];
    const double from_axis = (starts[k] - a).cross((b - a).normalized()).norm();
    const double lever = std::min(from_axis, std::abs(exact.distance));
    EXPECT_LE((way - expected).norm(), rounding * (1 + 0.75 / lever)) << starts[k].transpose();
  }
  for (const int count : counts) EXPECT_GT(count, 30);
}

// A round table top: what lies on it is held at its height, what hangs down keeps off the side.
TEST_P(SolidContact, ASheetHangsOverARoundTable) {
  constexpr double kRadius = 0.2, kDamping_per_s = 6;
  const Vector3d low(0.01, -0.6, 0.02), top(0.01, -0.1, 0.02);
  Scene scene = CentredSheet(13, 0.6, 0.6, CylinderBetween(low, top, kRadius));
  scene.parameters.damping_per_s = kDamping_per_s;
  scene.parameters.thickness_m = 0.005;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 360, /*measure=*/true);
  EXPECT_LE(report.measured.max_penetration_m, 1e-4);
  const ParticleState rest = ReadState(backend(), cloth);
  uint32_t on_top = 0, below = 0;
  for (const Vector3d& p : rest.positions_m) {
    const double from_axis = std::hypot(p.x() - low.x(), p.z() - low.z());
    on_top += from_axis < kRadius && std::abs(p.y() - top.y() - 0.005) < 1e-4;
    below += p.y() < top.y() - 0.02;
    EXPECT_GE(PlaceAtCylinder(low, top, kRadius, p).distance, 0.005 - 1e-4) << p.transpose();
  }
  EXPECT_GE(on_top, 30u) << "13 x 13 particles, 5 cm apart, over a disc of 40 cm";
  EXPECT_GE(below, 40u);
}

double DepthInCapsule(const Collider& collider, const Vector3d& q) {
  const auto& capsule = std::get<CapsuleShape>(collider.shape);
  // Along x: the distance in the plane across it, and beyond an end that to the end.
  const double x = std::clamp(q.x(), capsule.a_m.x(), capsule.b_m.x());
  return capsule.radius_m - (q - Vector3d(x, capsule.a_m.y(), capsule.a_m.z())).norm();
}

double DepthInBox(const Collider& collider, const Vector3d& q) {
  const auto& [half_extents_m] = std::get<BoxShape>(collider.shape);
  const auto& [position_m, rotation] = collider.pose;
  return (half_extents_m - (rotation.conjugate() * (q - position_m)).cwiseAbs()).minCoeff();
}

template <class Depth>
void ExpectNothingFallsIn(Backend& backend, ClothHandle cloth, const Scene& scene,
                          const Depth& depth, double turning_per_sq_m) {
  const double h = scene.parameters.settings.substep_s();
  // Within kTouchRoundOffs of the coordinates, 2 m in all, a particle rests where it is.
  const double rounding = (16 + 2 * kTouchRoundOffs) * UnitRoundOff(backend);
  const auto check = [&](const WatchedStep& step) {
    const double way = step.speed_m_per_s * h;
    EXPECT_LE(step.deepest_m, turning_per_sq_m * way * way + rounding);
    EXPECT_NEAR(step.reported_m, step.deepest_m, rounding);
  };
  EXPECT_GE(WatchFall(backend, cloth, scene, 60, depth, check), 3u) << "the sheet never lay on it";
}

// As for a sphere (contact_test): friction may take back what was tangential to the normal of an
// earlier sweep, and within a substep the normal turns by at most v h / r.
TEST_P(SolidContact, NothingFallsIntoACapsule) {
  constexpr double kRadius_m = 0.2;
  const Collider capsule = CapsuleBetween({-0.12, -0.3, 0.02}, {0.17, -0.3, 0.02}, kRadius_m);
  for (const double friction : {0.0, 0.5}) {
    SCOPED_TRACE("friction " + std::to_string(friction));
    const Scene scene = CentredSheet(7, 0.6, friction, capsule);
    ExpectNothingFallsIn(
        backend(), Make(scene), scene,
        [&](const Vector3d& q) { return DepthInCapsule(capsule, q); },
        friction == 0 ? 0 : 1 / kRadius_m);
  }
}

// The faces are flat; without friction the last projection of a sweep is exact, edges or not.
TEST_P(SolidContact, NothingFallsIntoABox) {
  const Collider box = BoxAt({0.02, -0.3, -0.01}, {0.17, 0.2, 0.13},
                             Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized());
  const Scene scene = CentredSheet(7, 0.6, 0, box);
  ExpectNothingFallsIn(
      backend(), Make(scene), scene, [&](const Vector3d& q) { return DepthInBox(box, q); }, 0);
}

// Friction takes back what was tangential to the normal of an earlier sweep; at an edge that can be
// the next face's normal. It took at most mu times what the face pushed, and that is no more than
// the way of the substep, v h, for each of the two sweeps.
TEST_P(SolidContact, WithFrictionNothingFallsDeepIntoABox) {
  const Collider box = BoxAt({0.02, -0.3, -0.01}, {0.17, 0.2, 0.13},
                             Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized());
  constexpr double kFriction = 0.5;
  const Scene scene = CentredSheet(7, 0.6, kFriction, box);
  const double h = scene.parameters.settings.substep_s();
  const auto check = [&](const WatchedStep& step) {
    EXPECT_LE(step.deepest_m, 2 * kFriction * step.speed_m_per_s * h + 16 * round_off());
  };
  const auto depth = [&](const Vector3d& q) { return DepthInBox(box, q); };
  EXPECT_GE(WatchFall(backend(), Make(scene), scene, 60, depth, check), 3u)
      << "the sheet never lay on it";
}

// Hung over a capsule, askew, a sheet comes to rest and friction keeps it there. The hanging part,
// at most 0.3 m long, swings with a frequency above c/2, so its swing decays as exp(-c t/2) in 6 s.
TEST_P(SolidContact, ASheetComesToRestOverACapsule) {
  constexpr double kDamping_per_s = 6;
  const Collider capsule = CapsuleBetween({-0.4, -0.3, 0.02}, {0.4, -0.3, 0.02}, 0.2);
  Scene scene = CentredSheet(7, 0.6, 0.6, capsule);
  scene.parameters.damping_per_s = kDamping_per_s;
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 360);
  const ParticleState rest = ReadState(backend(), cloth);
  StepAlone(backend(), cloth, scene, 60);
  const ParticleState later = ReadState(backend(), cloth);
  double drift = 0, deepest = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    drift = std::max(drift, (later.positions_m[i] - rest.positions_m[i]).norm());
    deepest = std::max(deepest, DepthInCapsule(capsule, later.positions_m[i]));
  }
  EXPECT_LE(drift, 0.6 * std::exp(-kDamping_per_s * 6 / 2) + 16 * round_off());
  EXPECT_LE(deepest, 16 * round_off());
}

// A contact sees where a particle is, not where it came from. A particle that moves by less than
// half the thickness per substep is held on the side that it came from ...
TEST_P(SolidContact, AThinBoxStopsWhatMovesLessThanHalfOfItPerSubstep) {
  for (const uint32_t substeps : {1u, 8u}) {
    const double h = 1.0 / 60 / substeps;
    Scene scene = LoneParticle(Vector3d(0, 0.03125, 0), Vector3d(0, -0.015 / h, 0));
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {BoxAt({0, 0, 0}, {1, 0.015625, 1})};
    scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
    scene.parameters.settings.substeps = substeps;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, 3);
    const ParticleState state = ReadState(backend(), cloth);
    EXPECT_NEAR(state.positions_m[0].y(), 0.015625, 4 * round_off() * 0.03125);
    EXPECT_NEAR(state.velocities_m_per_s[0].norm(), 0, 4 * round_off() * 0.015 / h);
  }
}

// ... and one that moves farther may pass: it is put onto the face that is then nearest, and leaves
// with the speed that this took, below twice its own.
TEST_P(SolidContact, AThinBoxLetsFasterParticlesThroughToItsOtherFace) {
  constexpr double kStep_s = 1.0 / 64;
  constexpr double kSpeed = 2;  // 1/32 m per step
  Scene scene = LoneParticle(Vector3d(0, 0.0234375, 0), Vector3d(0, -kSpeed, 0));
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.colliders = {BoxAt({0, 0, 0}, {1, 0.015625, 1})};
  scene.parameters.settings = SingleSubstep(kStep_s, 2);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene);
  const ParticleState passed = ReadState(backend(), cloth);
  EXPECT_EQ(passed.positions_m[0].y(), -0.015625);
  EXPECT_EQ(passed.velocities_m_per_s[0].y(), -(0.0234375 + 0.015625) / kStep_s);
  StepAlone(backend(), cloth, scene);
  EXPECT_EQ(ReadState(backend(), cloth).velocities_m_per_s[0], passed.velocities_m_per_s[0]);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(SolidContact);

}  // namespace
}  // namespace drape::test
