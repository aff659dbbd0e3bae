#include "server/api/spec_validation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/api/collider_control_validation.h"
#include "server/api/material_message.h"
#include "server/api/settings_message.h"
#include "server/api/topology_validation.h"
#include "server/scene/description_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

// Smallest sphere, capsule and box: single precision cannot tell the centre of a smaller one from
// its surface.
constexpr double kMinRadius_m = 1e-9;
// Far above any gravity; a step of 10 s still gives a finite velocity in single precision.
constexpr double kMaxAcceleration_m_per_s2 = 1e12;

// Unit vector along `v`, without overflow or underflow. `v` must not be zero. A unit vector stays
// as it is, so that what a client reads back and sends again keeps its bits.
Eigen::VectorXd UnitVector(const Eigen::VectorXd& v) {
  constexpr double kFewRoundings = 16 * std::numeric_limits<double>::epsilon();
  if (std::abs(v.squaredNorm() - 1) <= kFewRoundings) return v;
  const Eigen::VectorXd scaled = v / v.cwiseAbs().maxCoeff();
  return scaled / scaled.norm();
}

SphereCollider CheckSphere(const FieldPath& path, const v1::Sphere& sphere,
                           Violations& violations) {
  SphereCollider result;
  const auto center_m =
      CheckVector3(path.Child("center_m"), sphere.center_m(), kMaxExtent_m, "m", violations);
  violations.InRange(path.Child("radius_m"), sphere.radius_m(), {kMinRadius_m, kMaxExtent_m, "m"});
  if (center_m) result.center_m = *center_m;
  result.radius_m = sphere.radius_m();
  return result;
}

PlaneCollider CheckPlane(const FieldPath& path, const v1::Plane& plane, Violations& violations) {
  PlaneCollider result;
  const auto point_m =
      CheckVector3(path.Child("point_m"), plane.point_m(), kMaxExtent_m, "m", violations);
  const auto normal =
      CheckVector3(path.Child("normal"), plane.normal(), kMaxCoefficient, "", violations);
  if (point_m) result.point_m = *point_m;
  if (normal && violations.Require(!normal->isZero(0), path.Child("normal"), [] {
        return "(0, 0, 0) has no direction: a length > 0 is needed";
      })) {
    result.normal = UnitVector(*normal);
  }
  return result;
}

CapsuleCollider CheckCapsule(const FieldPath& path, const v1::Capsule& capsule,
                             Violations& violations) {
  CapsuleCollider result;
  const auto a_m = CheckVector3(path.Child("a_m"), capsule.a_m(), kMaxExtent_m, "m", violations);
  const auto b_m = CheckVector3(path.Child("b_m"), capsule.b_m(), kMaxExtent_m, "m", violations);
  violations.InRange(path.Child("radius_m"), capsule.radius_m(), {kMinRadius_m, kMaxExtent_m, "m"});
  if (a_m) result.a_m = *a_m;
  if (b_m) result.b_m = *b_m;
  result.radius_m = capsule.radius_m();
  return result;
}

// Empty: no rotation.
Eigen::Quaterniond CheckOptionalRotation(const FieldPath& path, const DoubleList& xyzw,
                                         Violations& violations) {
  if (xyzw.empty() || !violations.Length(path, static_cast<size_t>(xyzw.size()), 4, "x, y, z, w") ||
      !CheckAllWithin(path, xyzw, kMaxCoefficient, "", violations)) {
    return Eigen::Quaterniond::Identity();
  }
  return CheckRotation(path, {xyzw[0], xyzw[1], xyzw[2], xyzw[3]}, violations);
}

BoxCollider CheckBox(const FieldPath& path, const v1::Box& box, Violations& violations) {
  BoxCollider result;
  const FieldPath extents_path = path.Child("half_extents_m");
  const DoubleList& half_extents_m = box.half_extents_m();
  const auto center_m =
      CheckVector3(path.Child("center_m"), box.center_m(), kMaxExtent_m, "m", violations);
  if (center_m) result.center_m = *center_m;
  if (violations.Length(extents_path, static_cast<size_t>(half_extents_m.size()), 3, "x, y, z")) {
    for (int axis = 0; axis < 3; ++axis) {
      violations.InRange(extents_path.At(static_cast<size_t>(axis)), half_extents_m[axis],
                         {kMinRadius_m, kMaxExtent_m, "m"});
      result.half_extents_m[axis] = half_extents_m[axis];
    }
  }
  result.rotation =
      CheckOptionalRotation(path.Child("rotation_xyzw"), box.rotation_xyzw(), violations);
  return result;
}

// The map comes later, from a builder thread (collider_maps.h).
DistanceMapCollider CheckMeshCollider(const FieldPath& path, const v1::Collider& collider,
                                      const ClosedMeshLimits& limits, Violations& violations) {
  const FieldPath mesh_path = path.Child("mesh");
  if (CheckMeshArrays(mesh_path, collider.mesh(), violations)) {
    violations.CountInRange(mesh_path.Child("positions_m"), collider.mesh().positions_m().shape(0),
                            4, limits.max_vertices);
    violations.CountInRange(mesh_path.Child("triangles"), collider.mesh().triangles().shape(0), 4,
                            limits.max_triangles);
  }
  return {.map = nullptr,
          .transform = CheckTransform(path.Child("transform"), collider.transform(), violations)};
}

// Checks the fields that only meshes have.
void CheckMeshFields(const FieldPath& path, const v1::Collider& collider, Violations& violations) {
  if (collider.has_transform() && !collider.has_mesh()) {
    violations.Add(path.Child("transform"),
                   "belongs to mesh: the other shapes have a position of their own");
  }
}

}  // namespace

Eigen::Quaterniond CheckRotation(const FieldPath& path, const Eigen::Vector4d& values,
                                 Violations& violations) {
  if (!violations.Require(!values.isZero(0), path, [] {
        return "(0, 0, 0, 0) is not a rotation: a length > 0 is needed";
      })) {
    return Eigen::Quaterniond::Identity();
  }
  const Eigen::Vector4d unit = UnitVector(values);
  return {unit[3], unit[0], unit[1], unit[2]};
}

RigidTransform CheckTransform(const FieldPath& path, const v1::Transform& transform,
                              Violations& violations) {
  RigidTransform result;
  result.position_m = CheckVector3Or(result.position_m, path.Child("position_m"),
                                     transform.position_m(), kMaxExtent_m, "m", violations);
  result.rotation =
      CheckOptionalRotation(path.Child("rotation_xyzw"), transform.rotation_xyzw(), violations);
  return result;
}

std::vector<Collider> CheckColliders(
    const FieldPath& path, const google::protobuf::RepeatedPtrField<v1::Collider>& colliders,
    const RequestLimits& limits, Violations& violations) {
  std::vector<Collider> result;
  if (!violations.Require(
          static_cast<uint32_t>(colliders.size()) <= limits.max_colliders_per_cloth, path, [&] {
            return "has " + std::to_string(colliders.size()) + " elements, at most " +
                   std::to_string(limits.max_colliders_per_cloth) + " are allowed";
          })) {
    return result;
  }
  const auto mesh_count =
      std::count_if(colliders.begin(), colliders.end(), [](const auto& c) { return c.has_mesh(); });
  violations.Require(static_cast<uint64_t>(mesh_count) <= limits.max_mesh_colliders_per_cloth, path,
                     [&] {
                       return "has " + std::to_string(mesh_count) + " meshes, at most " +
                              std::to_string(limits.max_mesh_colliders_per_cloth) + " are allowed";
                     });
  for (int k = 0; k < colliders.size(); ++k) {
    const FieldPath here = path.At(k);
    CheckMeshFields(here, colliders[k], violations);
    switch (colliders[k].shape_case()) {
      case v1::Collider::kSphere:
        result.emplace_back(CheckSphere(here.Child("sphere"), colliders[k].sphere(), violations));
        break;
      case v1::Collider::kPlane:
        result.emplace_back(CheckPlane(here.Child("plane"), colliders[k].plane(), violations));
        break;
      case v1::Collider::kCapsule:
        result.emplace_back(
            CheckCapsule(here.Child("capsule"), colliders[k].capsule(), violations));
        break;
      case v1::Collider::kBox:
        result.emplace_back(CheckBox(here.Child("box"), colliders[k].box(), violations));
        break;
      case v1::Collider::kMesh:
        result.emplace_back(
            CheckMeshCollider(here, colliders[k], limits.collider_mesh, violations));
        break;
      case v1::Collider::SHAPE_NOT_SET:
        violations.Add(here, "no shape is set: one of sphere, plane, capsule, box, mesh is needed");
        break;
    }
  }
  return result;
}

std::vector<Pin> CheckPinTargets(const FieldPath& path,
                                 const google::protobuf::RepeatedPtrField<v1::Pin>& pins,
                                 Violations& violations) {
  std::vector<Pin> result;
  for (int k = 0; k < pins.size() && !violations.is_full(); ++k) {
    Pin pin{.particle = pins[k].particle(), .target_m = {}};
    if (!pins[k].target_m().empty()) {
      pin.target_m = CheckVector3(path.At(k).Child("target_m"), pins[k].target_m(), kMaxExtent_m,
                                  "m", violations);
    }
    result.push_back(pin);
  }
  return result;
}

Eigen::Vector3d CheckGravity(const FieldPath& path, const DoubleList& gravity_m_per_s2,
                             const Eigen::Vector3d& fallback, Violations& violations) {
  return CheckVector3Or(fallback, path, gravity_m_per_s2, kMaxAcceleration_m_per_s2, "m/s^2",
                        violations);
}

Eigen::Vector3d CheckWind(const FieldPath& path, const DoubleList& wind_m_per_s,
                          const Eigen::Vector3d& fallback, Violations& violations) {
  return CheckVector3Or(fallback, path, wind_m_per_s, kMaxWind_m_per_s, "m/s", violations);
}

CheckedSpec CheckSpec(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                      Violations& violations) {
  CheckedSpec result;
  result.description.material = ReadStructuralMaterial(spec.material());
  for (const v1::Pin& pin : spec.pins()) {
    result.description.pinned_particles.push_back(pin.particle());
  }
  if (std::optional<Topology> topology = ReadTopology(path, spec, violations)) {
    result.description.topology = std::move(*topology);
    violations.AddAll(CheckDescription(result.description, limits.model), path.ToString() + ".");
  }
  result.pins = CheckPinTargets(path.Child("pins"), spec.pins(), violations);
  result.transform = CheckTransform(path.Child("transform"), spec.transform(), violations);

  const FieldPath environment_path = path.Child("environment");
  const v1::Environment& environment = spec.environment();
  result.parameters.gravity_m_per_s2 =
      CheckGravity(environment_path.Child("gravity_m_per_s2"), environment.gravity_m_per_s2(),
                   result.parameters.gravity_m_per_s2, violations);
  result.parameters.wind_m_per_s =
      CheckWind(environment_path.Child("wind_m_per_s"), environment.wind_m_per_s(),
                result.parameters.wind_m_per_s, violations);
  result.parameters.colliders = CheckColliders(environment_path.Child("colliders"),
                                               environment.colliders(), limits, violations);
  result.parameters.collider_motions =
      CheckColliderMotions(environment_path.Child("colliders"), environment.colliders(),
                           result.parameters.colliders, violations);
  CheckSurfaceMaterial(path.Child("material"), spec.material(), result.parameters, violations);
  result.parameters.settings = CheckSettings(path.Child("settings"), spec.settings(), violations);
  return result;
}

}  // namespace drape::api
