// Sheets and particles on closed meshes, by their distance maps: against the surfaces that the
// meshes approximate.
#include <algorithm>
#include <cmath>
#include <iostream>

#include "server/scene/distance_map.h"
#include "server/scene/mesh_distance.h"
#include "tests/physics/falling_sheet.h"
#include "tests/support/obj_file.h"
#include "tests/support/paths/paths.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;
// Samples are floats on every backend.
constexpr double kSampleRoundOff = 0x1p-24;

std::shared_ptr<const DistanceMap> MapOf(const TriangleMesh& mesh, uint32_t resolution) {
  return DistanceMap::Build(mesh, {.resolution = resolution}).value();
}

class MeshContact : public PhysicsTest {};
class MeshContactLong : public PhysicsTest {};

// A block of 1 m x 1 m, 0.2 m high, its top through the origin, turned by the slope about z.
struct MeshIncline {
  double angle;
  std::shared_ptr<const DistanceMap> map = MapOf(BoxMesh({-0.5, -0.2, -0.5}, {0.5, 0, 0.5}), 40);
  Vector3d downhill{-std::cos(angle), -std::sin(angle), 0};
  Vector3d normal{-std::sin(angle), std::cos(angle), 0};

  Scene WithABlock(double friction_static, double friction_dynamic) const {
    Scene scene = LoneParticle(Vector3d::Zero(), Vector3d::Zero());
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
    scene.parameters.colliders = {DistanceMapAt(map, {Vector3d::Zero(), turn})};
    scene.parameters.friction_static = friction_static;
    scene.parameters.friction_dynamic = friction_dynamic;
    scene.parameters.settings = SingleSubstep(1.0 / 60, 1);
    scene.parameters.settings.substeps = 10;
    return scene;
  }
};

// Around the face of a block far from its edges all samples are distances to that face: less than
// two cells, 0.05 m, rounded once. Their interpolation is off by that and by the 32 roundings of a
// place (tests/parity/round_off.h) of coordinates below 1 m.
double FaceRounding(double round_off) {
  return 0.05 * kSampleRoundOff + 32 * round_off;
}

// tan(20 degrees) = 0.364 < mu_s: no creep in 1000 steps. Each of the 10^4 substeps may leave 4
// roundings of the velocity that gravity gave it, g h; and it settles on the face, once.
TEST_P(MeshContact, ABlockSticksOnAnInclineBelowTheStaticFriction) {
  const MeshIncline incline{20 * M_PI / 180};
  const Scene scene = incline.WithABlock(0.4, 0.3);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 1000);
  const double h = scene.parameters.settings.substep_s();
  EXPECT_LE(ReadState(backend(), cloth).positions_m[0].norm(),
            1e4 * 4 * round_off() * kG * h * h + 2 * FaceRounding(round_off()));
}

// The same, beyond: a = g (sin - mu_d cos). 180 substeps of some 12 roundings each, of the speed
// and of g h. Differences of samples are off by two of their roundings, over a cell of half their
// size: they tilt the face by 4 kSampleRoundOff, the axes by 4 more of the backend's.
TEST_P(MeshContact, ABlockSlidesOnAnInclineWithTheDynamicFriction) {
  for (const double degrees : {22.8, 45.0}) {
    const MeshIncline incline{degrees * M_PI / 180};
    const Scene scene = incline.WithABlock(0.4, 0.3);
    const ClothHandle cloth = Make(scene);
    constexpr uint32_t kSteps = 18;
    const double seconds = kSteps / 60.0;
    StepAlone(backend(), cloth, scene, kSteps);
    const ParticleState state = ReadState(backend(), cloth);
    const double acceleration = kG * (std::sin(incline.angle) - 0.3 * std::cos(incline.angle));
    const double tilt = 4 * kSampleRoundOff + 4 * round_off();
    const double speed_bound = (180 * 12 * round_off() + 2 * tilt) * kG * seconds;
    EXPECT_NEAR(state.velocities_m_per_s[0].dot(incline.downhill), acceleration * seconds,
                speed_bound);
    EXPECT_NEAR(state.positions_m[0].dot(incline.downhill), acceleration / 2 * seconds * seconds,
                speed_bound * seconds);
    EXPECT_NEAR(state.positions_m[0].dot(incline.normal), 0, 2 * FaceRounding(round_off()));
  }
}

// A sheet dropped on the block rests thickness above its face and does not sink in 5 s.
TEST_P(MeshContact, ASheetAtRestOnABlockDoesNotSink) {
  constexpr double kThickness = 0.0078125;
  Scene scene = Grid(7, 7, 0.6, 0.6);
  for (Vector3d& p : scene.state.positions_m) p += Vector3d(-0.3, 0.05, -0.3);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d::UnitY()));
  scene.parameters.colliders = {DistanceMapAt(MeshIncline{0}.map, {Vector3d::Zero(), turn})};
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.5;
  scene.parameters.thickness_m = kThickness;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
  scene.parameters.settings.substeps = 8;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 300, true);
  const double rounding = 2 * FaceRounding(round_off());
  for (const Vector3d& p : ReadState(backend(), cloth).positions_m) {
    EXPECT_NEAR(p.y(), kThickness, rounding);
  }
  EXPECT_EQ(report.measured.contacts, scene.model->particle_count());
  EXPECT_LE(report.measured.max_penetration_m, rounding);
}

// A ball of radius 0.5 m whose corners are on the sphere.
struct MeshBall {
  static constexpr double kRadius = 0.5;
  TriangleMesh mesh = SphereMesh(kRadius, 4);
  std::shared_ptr<const DistanceMap> map = MapOf(mesh, 40);
  double sagitta = LargestSagitta(mesh, kRadius);

  // Smallest radius of curvature within a cell of the surface.
  double InnerRadius() const { return kRadius - std::sqrt(3.0) * map->cell_m(); }
  // Interpolation is second order in the cell (distance_map.h), the facets are inside the sphere.
  double DistanceError() const {
    return 3.0 / 8 * map->cell_m() * map->cell_m() / InnerRadius() + sagitta;
  }
  // Error of its gradient: along each axis half a cell times the curvature, and two samples that
  // are off by the sagitta, over a cell.
  double GradientError() const {
    return std::sqrt(3.0) * (map->cell_m() / (2 * InnerRadius()) + 2 * sagitta / map->cell_m());
  }
};

// Particles that friction holds where they land: they rest at the radius, within the map's error.
// On slopes up to 45 degrees, of gradients that are off by less than 15, friction of 2 holds them.
TEST_P(MeshContact, ParticlesRestOnABallAtItsRadius) {
  const MeshBall ball;
  ASSERT_LE(ball.DistanceError(), ball.map->error_bound_m());
  ASSERT_LE(ball.GradientError(), 0.2);
  const RigidTransform transform{{0.25, -0.5, 0.75},
                                 Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized()};
  constexpr double kThickness = 0.01;
  ParticleTopology particles;
  for (int k = 0; k < 60; ++k) {
    const double down = M_PI / 4 * std::sqrt((k + 0.5) / 60), around = 2.4 * k;
    const Vector3d direction(std::sin(down) * std::cos(around), std::cos(down),
                             std::sin(down) * std::sin(around));
    particles.positions_m.push_back(transform.position_m + (MeshBall::kRadius + 0.012) * direction);
    particles.masses_kg.push_back(0.125);
  }
  Scene scene = Particles(particles);
  scene.parameters.colliders = {DistanceMapAt(ball.map, transform)};
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 2;
  scene.parameters.thickness_m = kThickness;
  scene.parameters.settings = SingleSubstep(1.0 / 60, 2);
  scene.parameters.settings.substeps = 4;
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene, 120);
  const ParticleState state = ReadState(backend(), cloth);
  for (const Vector3d& p : state.positions_m) {
    EXPECT_NEAR((p - transform.position_m).norm(), MeshBall::kRadius + kThickness,
                ball.DistanceError() + 72 * round_off());
  }
  for (const Vector3d& v : state.velocities_m_per_s) EXPECT_LE(v.norm(), 1e-3 * kG / 240);
}

// A projection leaves the part of the way v h of a substep by which the gradient is not a unit
// vector.
TEST_P(MeshContact, NothingFallsIntoABall) {
  const MeshBall ball;
  const Vector3d center(0.05, -0.6, -0.03);
  const Eigen::Quaterniond turn(0.9, 0.1, 0.3, -0.2);
  const Scene scene = CentredSheet(9, 0.8, 0, DistanceMapAt(ball.map, {center, turn.normalized()}));
  const double h = scene.parameters.settings.substep_s();
  const auto depth = [&](const Vector3d& p) { return MeshBall::kRadius - (p - center).norm(); };
  const auto check = [&](const WatchedStep& step) {
    const double left = step.speed_m_per_s * h * ball.GradientError() + 72 * round_off();
    EXPECT_LE(step.deepest_m, ball.DistanceError() + left);
    EXPECT_LE(step.reported_m, left);
  };
  EXPECT_GE(WatchFall(backend(), Make(scene), scene, 40, depth, check), 5u)
      << "the sheet never lay on it";
}

// A cloth dropped on a real table (1.1 million samples) comes to lie on it and hangs down. Nothing
// is inside by more than the map's error, by another measure of distance, and the table holds up
// every particle that was over the top, 20 mm and more from its edges. (Sharp corners can pass
// between particles: only these touch. The hanging part may swing in under the top.)
TEST_P(MeshContactLong, ATableclothLiesOnTheTable) {
  const TriangleMesh mesh = ReadObj(SourcePath("client/examples/meshes/table.obj"), 1);
  const auto map = DistanceMap::Build(mesh).value();
  constexpr double kTop = 0.9745, kHalfWidth = 0.2, kHalfLength = 0.33;
  Scene scene = Grid(29, 39, 0.7, 0.95);
  for (Vector3d& p : scene.state.positions_m) p += Vector3d(-0.35, kTop + 0.02, -0.475);
  scene.parameters.colliders = {DistanceMapAt(map)};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.damping_per_s = 2;
  const ClothHandle cloth = Make(scene);
  const StepReport report = StepAlone(backend(), cloth, scene, 150, true);
  const ParticleState state = ReadState(backend(), cloth);
  const MeshDistance exact(mesh);
  const double accepted = map->error_bound_m() + report.measured.max_penetration_m;
  uint32_t over_count = 0;
  double deepest = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const Vector3d& p = state.positions_m[i];
    deepest = std::max(deepest, -exact.At(p).distance_m);
    const Vector3d& start = scene.state.positions_m[i];
    if (std::abs(start.x()) > kHalfWidth || std::abs(start.z()) > kHalfLength) continue;
    ++over_count;
    EXPECT_GE(p.y(), kTop - accepted) << p.transpose();
  }
  std::cout << "MEASURED " << GetParam() << ": deepest " << 1e3 * deepest << " mm, bound "
            << 1e3 * map->error_bound_m() << " mm, contacts " << report.measured.contacts << "\n";
  EXPECT_LE(deepest, accepted);
  EXPECT_EQ(over_count, 17u * 27u) << "every 25 mm from -0.2 to 0.2 and from -0.325 to 0.325";
  EXPECT_GE(report.measured.contacts, over_count);
  EXPECT_LT(report.measured.lowest_m, kTop - 0.08) << "its sides hang down";
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(MeshContact);
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(MeshContactLong);

}  // namespace
}  // namespace drape::test
