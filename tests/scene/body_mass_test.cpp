// Masses and inertias of solids against integrals over them.
#include "server/scene/body_mass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "server/scene/closed_mesh.h"
#include "server/scene/distance_map.h"

namespace drape {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

// Of a solid of revolution about z: discs of radius r(z), by the midpoint rule.
struct Revolved {
  double mass = 0, along = 0, across = 0;
};
Revolved Integrate(double half, const std::function<double(double)>& radius) {
  constexpr int kDiscs = 200'000;
  Revolved sum;
  const double dz = 2 * half / kDiscs;
  for (int k = 0; k < kDiscs; ++k) {
    const double z = -half + (k + 0.5) * dz;
    const double area = pi * std::pow(radius(z), 2);
    sum.mass += area * dz;
    sum.along += area * std::pow(radius(z), 2) / 2 * dz;
    sum.across += area * (std::pow(radius(z), 2) / 4 + z * z) * dz;
  }
  return sum;
}

void ExpectRevolved(Collider collider, const Vector3d& axis, const Vector3d& centre,
                    const Revolved& expected) {
  collider.density_kg_per_m3 = 800;
  const BodyMass mass = MassOf(collider);
  // The rule is off by less than (dz/half)^2.
  constexpr double kRule = 1e-9;
  EXPECT_NEAR(mass.mass_kg, 800 * expected.mass, kRule * mass.mass_kg);
  EXPECT_NEAR((mass.centre_m - centre).norm(), 0, 1e-15);
  const Matrix3d outer = axis * axis.transpose();
  const Matrix3d inertia =
      800 * (expected.along * outer + expected.across * (Matrix3d::Identity() - outer));
  EXPECT_NEAR((mass.inertia - inertia).norm(), 0, kRule * inertia.norm());
}

TEST(BodyMass, RoundSolidsAreTheIntegralsOfTheirDiscs) {
  const auto ball = [](double r, double z) { return std::sqrt(std::max(r * r - z * z, 0.0)); };
  ExpectRevolved(SphereAt({1, 2, 3}, 0.3), Vector3d::UnitX(), {1, 2, 3},
                 Integrate(0.3, [&](double z) { return ball(0.3, z); }));
  const Vector3d axis = Vector3d(2, -1, 2) / 3;
  const Vector3d centre(0.1, 0.2, -0.4);
  ExpectRevolved(CylinderBetween(centre - 0.25 * axis, centre + 0.25 * axis, 0.1), axis, centre,
                 Integrate(0.25, [](double) { return 0.1; }));
  ExpectRevolved(CapsuleBetween(centre - 0.25 * axis, centre + 0.25 * axis, 0.1), axis, centre,
                 Integrate(0.35, [&](double z) {
                   return std::abs(z) <= 0.25 ? 0.1 : ball(0.1, std::abs(z) - 0.25);
                 }));
}

TriangleMesh BoxMesh(const Vector3d& low, const Vector3d& high) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.positions_m.emplace_back(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                                  corner & 4 ? high.z() : low.z());
  }
  const auto face = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  face(0, 2, 3, 1);
  face(4, 5, 7, 6);
  face(0, 1, 5, 4);
  face(2, 6, 7, 3);
  face(0, 4, 6, 2);
  face(1, 3, 7, 5);
  return mesh;
}

// Exact for what is bounded by triangles: rounding of the sums, of a dozen terms each.
TEST(BodyMass, AMeshIsWhatItEncloses) {
  const Vector3d low(0.2, -0.1, 0.5), high(0.4, 0.3, 0.6);
  const TriangleMesh mesh = BoxMesh(low, high);
  DistanceMapSettings settings;
  settings.resolution = 8;
  const auto map = DistanceMap::Build(mesh, settings);
  ASSERT_TRUE(map.ok()) << map.status().ToString();
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(1.1, Vector3d(1, -2, 2) / 3));
  const RigidTransform pose{{3, -1, 2}, turned};
  Collider solid = DistanceMapAt(*map, pose);
  Collider box = BoxAt(pose * Vector3d((low + high) / 2), (high - low) / 2, turned);
  solid.mass_kg = box.mass_kg = 1.7;
  const BodyMass its = MassOf(solid), expected = MassOf(box);
  EXPECT_EQ(its.mass_kg, 1.7);
  EXPECT_NEAR((its.centre_m - expected.centre_m).norm(), 0, 64 * 2.3e-16 * pose.position_m.norm());
  EXPECT_NEAR((its.inertia - expected.inertia).norm(), 0, 1e-13 * expected.inertia.norm());
  EXPECT_NEAR((*map)->moments().radius_m, (high - low).norm() / 2, 1e-15);
  EXPECT_EQ((*map)->outermost_m().size(), 8u);  // its corners
}

TEST(BodyMass, ACapsuleWithoutLengthIsASphere) {
  Collider capsule = CapsuleBetween({1, 1, 1}, {1, 1, 1}, 0.2);
  Collider sphere = SphereAt({1, 1, 1}, 0.2);
  capsule.mass_kg = sphere.mass_kg = 3;
  EXPECT_NEAR((MassOf(capsule).inertia - MassOf(sphere).inertia).norm(), 0, 1e-16);
}

}  // namespace
}  // namespace drape
