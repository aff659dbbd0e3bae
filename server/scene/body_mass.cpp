#include "server/scene/body_mass.h"

#include <numbers>

#include "server/core/check.h"
#include "server/scene/closed_mesh.h"
#include "server/scene/distance_map.h"

namespace drape {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

// Per density, in the frame of the shape.
struct UnitBody {
  double volume_m3 = 0;
  Vector3d centre_m = Vector3d::Zero();
  Matrix3d inertia_m5 = Matrix3d::Zero();
};

// Of a body with an axis of revolution between a and b.
UnitBody Revolved(double volume, const Vector3d& a, const Vector3d& b, double along,
                  double across) {
  const Vector3d segment = b - a;
  const Vector3d axis = segment.isZero(0) ? Vector3d::UnitX() : segment.stableNormalized();
  const Matrix3d outer = axis * axis.transpose();
  return {volume, (a + b) / 2, along * outer + across * (Matrix3d::Identity() - outer)};
}

UnitBody Of(const SphereShape& sphere) {
  const double volume = 4 * pi / 3 * std::pow(sphere.radius_m, 3);
  const double inertia = 0.4 * volume * sphere.radius_m * sphere.radius_m;
  return {volume, Vector3d::Zero(), inertia * Matrix3d::Identity()};
}

UnitBody Of(const BoxShape& box) {
  const Vector3d& half = box.half_extents_m;
  const double volume = 8 * half.prod();
  const Vector3d squares = half.cwiseAbs2();
  const Vector3d inertia = volume / 3 * (Vector3d::Constant(squares.sum()) - squares);
  return {volume, Vector3d::Zero(), inertia.asDiagonal()};
}

// A cylinder and two half spheres, whose centres of mass are 3/8 R beyond its ends.
UnitBody Of(const CapsuleShape& capsule) {
  const double r = capsule.radius_m;
  const double length = (capsule.b_m - capsule.a_m).norm();
  const double tube = pi * r * r * length;
  const double ends = 4 * pi / 3 * r * r * r;
  const double along = tube * r * r / 2 + ends * 0.4 * r * r;
  const double across = tube * (length * length / 12 + r * r / 4) +
                        ends * (0.4 * r * r + length * length / 4 + 3 * length * r / 8);
  return Revolved(tube + ends, capsule.a_m, capsule.b_m, along, across);
}

UnitBody Of(const CylinderShape& cylinder) {
  const double r = cylinder.radius_m;
  const double length = (cylinder.b_m - cylinder.a_m).norm();
  const double volume = pi * r * r * length;
  return Revolved(volume, cylinder.a_m, cylinder.b_m, volume * r * r / 2,
                  volume * (length * length / 12 + r * r / 4));
}

UnitBody Of(const DistanceMapShape& solid) {
  const SolidMoments& moments = solid.map->moments();
  return {moments.volume_m3, moments.centroid_m,
          moments.second_m5.trace() * Matrix3d::Identity() - moments.second_m5};
}

UnitBody Of(const PlaneShape&) {
  DRAPE_CHECK(false, "a plane has no mass");
  return {};
}

}  // namespace

BodyMass MassOf(const Collider& collider) {
  const UnitBody body = std::visit([](const auto& shape) { return Of(shape); }, collider.shape);
  double density = 1;
  if (collider.density_kg_per_m3 > 0) density = collider.density_kg_per_m3;
  if (collider.mass_kg > 0) density = collider.mass_kg / body.volume_m3;
  const Matrix3d turned = collider.pose.rotation.toRotationMatrix();
  return {density * body.volume_m3, collider.pose * body.centre_m,
          density * (turned * body.inertia_m5 * turned.transpose())};
}

Vector3d CentreOfMass(const Collider& collider) {
  return MassOf(collider).centre_m;
}

}  // namespace drape
