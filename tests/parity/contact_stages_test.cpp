// The stages of contacts alone, every backend in single precision against the reference. Bounds:
// round_off.h.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/parity/loose_particles.h"
#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class ContactStageParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, ContactStageParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(ContactStageParityTest, SolveContacts) {
  Scene scene = LooseParticles({{0, 0.001, 0},      // through the plane within the step
                                {5, 0.5, 5},        // touches nothing
                                {0.02, -0.3, 0.1},  // starts inside the sphere
                                {2, -3, 0},         // starts deep below the plane
                                {0, -0.5, 0}});     // at the sphere's centre
  scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d(0.6, 0.8, 0)),
                                SphereAt(Vector3d(0, -0.5, 0), 0.25)};
  scene.parameters.thickness_m = 0.01;
  scene.state.velocities_m_per_s.assign(5, Vector3d(0.2, -1, 0.1));
  for (const uint32_t sweeps : {1u, 4u}) {
    SetSubsteps(scene, 1, sweeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(ContactStageParityTest, SolveContactsWithACapsule) {
  Scene scene = LooseParticles({{0.1, -0.22, 0.02},   // beside the segment
                                {0.85, -0.31, 0.35},  // at an end
                                {-0.75, -0.5, -0.3},  // beyond the other
                                {0.0, -0.5, 0.0},     // on the segment
                                {0.25, -0.45, 0.1},   // deep inside
                                {-0.5, -0.5, -0.25},  // at end a
                                {3, 1, 2}});          // touches nothing
  scene.parameters.colliders = {
      CapsuleBetween(Vector3d(-0.5, -0.5, -0.25), Vector3d(0.75, -0.5, 0.375), 0.25)};
  scene.parameters.thickness_m = 0.01;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.3;
  scene.state.velocities_m_per_s.assign(7, Vector3d(0.2, -1, 0.1));
  for (const uint32_t sweeps : {1u, 4u}) {
    SetSubsteps(scene, 1, sweeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(ContactStageParityTest, SolveContactsWithACylinder) {
  const Vector3d a(-0.5, -0.5, -0.25), b(0.75, -0.25, 0.375);
  const Vector3d axis = (b - a).normalized();
  const Vector3d up = axis.cross(Vector3d::UnitX()).normalized(), side = axis.cross(up);
  std::vector<Vector3d> positions;
  for (const Vector3d& local : {Vector3d(0.1, 0.26, 0.02),     // beside the axis
                                Vector3d(0.725, 0.1, 0.05),    // above an end
                                Vector3d(0.725, 0.262, 0.02),  // at a rim
                                Vector3d(-0.73, 0.1, -0.25),   // at the other
                                Vector3d(0.3, -0.1, 0.08),     // deep inside
                                Vector3d(0.65, 0.05, -0.02),   // inside, nearest to an end
                                Vector3d(3, 1, 2)}) {          // touches nothing
    positions.push_back((a + b) / 2 + local.x() * axis + local.y() * up + local.z() * side);
  }
  Scene scene = LooseParticles(positions);
  scene.parameters.colliders = {CylinderBetween(a, b, 0.25)};
  scene.parameters.thickness_m = 0.02;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.3;
  scene.state.velocities_m_per_s.assign(positions.size(), Vector3d(-0.2, -0.5, 0.1));
  for (const uint32_t sweeps : {1u, 4u}) {
    SetSubsteps(scene, 1, sweeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

TEST_P(ContactStageParityTest, SolveContactsWithABox) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.6, Vector3d(1, 2, -2) / 3));
  const Vector3d center(0.1, -0.5, 0.2), half_extents(0.5, 0.3, 0.4);
  std::vector<Vector3d> positions;
  for (const Vector3d& local : {Vector3d(0.1, 0.32, 0.05),     // above a face
                                Vector3d(0.515, 0.312, 0.1),   // at an edge
                                Vector3d(0.51, 0.31, -0.42),   // at a corner
                                Vector3d(-0.2, 0.1, 0.31),     // deep inside, nearest to +z
                                Vector3d(-0.47, 0.02, -0.05),  // inside, nearest to -x
                                Vector3d(0.1, -0.31, 0.05),    // below
                                Vector3d(2, 3, -1)}) {         // touches nothing
    positions.push_back(center + turn * local);
  }
  Scene scene = LooseParticles(positions);
  scene.parameters.colliders = {BoxAt(center, half_extents, turn)};
  scene.parameters.thickness_m = 0.02;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.3;
  scene.state.velocities_m_per_s.assign(7, turn * Vector3d(-0.1, -0.5, 0.05));
  for (const uint32_t sweeps : {1u, 4u}) {
    SetSubsteps(scene, 1, sweeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

// Enough particles for the tiled plan, which has kernels of its own for contacts.
TEST_P(ContactStageParityTest, SolveContactsOfManyParticlesWithACapsuleABoxAndACylinder) {
  std::vector<Vector3d> positions;
  for (uint32_t k = 0; k < 1100; ++k) {
    const double angle = 0.37 * k;
    positions.emplace_back(0.4 * std::cos(angle), 0.26 + 1e-4 * (k % 7), -0.6 + 1e-3 * k);
  }
  Scene scene = LooseParticles(positions);
  scene.parameters.colliders = {
      CapsuleBetween(Vector3d(-0.75, 0, -0.3), Vector3d(0.75, 0, -0.3), 0.25),
      BoxAt(Vector3d(0, 0, 0.3), Vector3d(0.5, 0.25, 0.4)),
      CylinderBetween(Vector3d(-0.1, -0.3, -0.5), Vector3d(-0.1, 0.23, -0.5), 0.3)};
  scene.parameters.thickness_m = 0.02;
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  scene.state.velocities_m_per_s.assign(positions.size(), Vector3d(0.2, -1, 0.1));
  SetSubsteps(scene, 2, 2);
  ExpectParity(GetParam(), scene, 2);
}

// Both at once, and a point of equally near faces: all of them take the first.
TEST_P(ContactStageParityTest, SolveContactsAtTheCentreOfABox) {
  Scene scene = LooseParticles({{0.5, -1, 0.25}, {0.5, -0.875, 0.25}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.colliders = {BoxAt({0.5, -1, 0.25}, {0.25, 0.25, 0.25}),
                                SphereAt({0.5, -0.75, 0.25}, 0.0625)};
  SetSubsteps(scene, 1, 2);
  ExpectParity(GetParam(), scene, 3);
}

// The normal is a fixed perpendicular where the side is nearest, that of an end near it.
TEST_P(ContactStageParityTest, SolveContactsOnTheAxisOfACylinder) {
  Scene scene = LooseParticles({{0.125, -0.5, 0}, {0.4375, -0.5, 0}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.colliders = {CylinderBetween({-0.5, -0.5, 0}, {0.5, -0.5, 0}, 0.25)};
  SetSubsteps(scene, 1, 2);
  ExpectParity(GetParam(), scene, 3);
}

// Sticks below the static coefficient and slides above it; the slopes are far from the limit.
TEST_P(ContactStageParityTest, SolveContactsWithFriction) {
  for (const double slope : {0.1, 0.9}) {
    Scene scene = LooseParticles({{0, 0, 0}, {0.3, 0.3 * slope, 0}});
    const Vector3d normal = Vector3d(-slope, 1, 0).normalized();
    scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), normal)};
    scene.parameters.friction_static = 0.5;
    scene.parameters.friction_dynamic = 0.3;
    SetSubsteps(scene, 4, 2);
    ExpectParity(GetParam(), scene, 3);
  }
}

TEST_P(ContactStageParityTest, CorrectVelocityStopsTheApproach) {
  Scene scene = LooseParticles({{0, 0, 0}, {1, 0, 1}});
  scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d::UnitY())};
  scene.state.velocities_m_per_s = {{0.5, -2, 0}, {0, -0.1, 0}};
  SetSubsteps(scene, 1);
  ExpectParity(GetParam(), scene, 3);

  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene);
  for (const Vector3d& v : ReadState(backend, cloth).velocities_m_per_s) {
    EXPECT_EQ(v.y(), 0) << "no velocity into the plane is left";
  }
  backend.Destroy(cloth);
}

// Fast and slow ones, one that comes straight and one that slides along, one from below a sphere;
// the first three hit within a step or two.
TEST_P(ContactStageParityTest, CorrectVelocityRebounds) {
  Scene scene =
      LooseParticles({{0, 0.02, 0}, {1, 0.01, 1}, {2, 0.03, 0}, {0.1, 0.6, 0.05}, {3, 0.0001, 0}});
  scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()),
                                SphereAt(Vector3d(0, 1, 0), 0.35)};
  scene.parameters.restitution = 0.7;
  scene.state.velocities_m_per_s = {{0.5, -2, 0}, {3, -4, 1}, {0, -1, 0}, {0, 5, 0}, {0, -0.01, 0}};
  for (const double friction : {0.0, 0.4}) {
    scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
    for (const uint32_t substeps : {1u, 4u}) {
      SetSubsteps(scene, substeps, 2);
      ExpectParity(GetParam(), scene, 4);
    }
  }
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene, 2);
  EXPECT_GT(ReadState(backend, cloth).velocities_m_per_s[0].y(), 1) << "it did not bounce";
  backend.Destroy(cloth);
}

// Every shape, moving and turning about a point of its own, over several steps, with friction and
// rebound. Fast turns among them: more than a quarter per step.
TEST_P(ContactStageParityTest, SolveContactsWithMovingColliders) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.6, Vector3d(1, 2, -2) / 3));
  Scene scene = LooseParticles({{0.1, 0.02, 0.1},     // meets the plane
                                {1.0, 0.62, 0.05},    // above the box
                                {-1.0, 0.48, 0.02},   // beside the capsule
                                {0.02, 1.3, 0.1},     // in the way of the sphere
                                {0.9, -0.01, -0.6},   // below the plane already
                                {0.1, 0.72, 1.05}});  // above the cylinder's side
  scene.parameters.colliders = {
      PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()),
      BoxAt(Vector3d(1, 0.3, 0), Vector3d(0.4, 0.3, 0.3), turn),
      CapsuleBetween(Vector3d(-1.3, 0.3, 0), Vector3d(-0.7, 0.3, 0.1), 0.15),
      SphereAt(Vector3d(0, 1, 0), 0.25),
      CylinderBetween(Vector3d(-0.4, 0.5, 1), Vector3d(0.5, 0.5, 1.1), 0.2)};
  for (const Collider& collider : scene.parameters.colliders) {
    scene.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  auto& motions = scene.parameters.collider_motions;
  motions[0].velocity_m_per_s = Vector3d(0.5, 0.4, -0.2);
  motions[0].angular_velocity_rad_per_s = Vector3d(0, 2, 0);
  motions[1].pivot_m = motions[1].position_m = Vector3d(1.2, 0.1, 0.1);
  motions[1].angular_velocity_rad_per_s = Vector3d(1, -2, 0.5);
  motions[2].rotation = turn;
  motions[2].angular_velocity_rad_per_s = Vector3d(0, 0, 100);
  motions[3].velocity_m_per_s = Vector3d(0, 3, 0.5);
  motions[4].velocity_m_per_s = Vector3d(0.1, 0.2, 0);
  motions[4].angular_velocity_rad_per_s = Vector3d(8, 0, 0.5);
  scene.parameters.thickness_m = 0.02;
  scene.state.velocities_m_per_s.assign(6, Vector3d(0.2, -1, 0.1));
  for (const double friction : {0.0, 0.4}) {
    scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
    scene.parameters.restitution = friction;
    for (const uint32_t sweeps : {1u, 3u}) {
      SetSubsteps(scene, 2, sweeps);
      ExpectParity(GetParam(), scene, 4);
    }
  }
}

}  // namespace
}  // namespace drape::test
