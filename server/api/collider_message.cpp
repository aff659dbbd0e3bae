#include "server/api/collider_message.h"

#include <algorithm>
#include <string>
#include <variant>

#include "server/api/geometry_message.h"
#include "server/api/joint_message.h"
#include "server/api/topology_validation.h"
#include "server/scene/description_checks.h"
#include "server/scene/distance_map.h"

namespace drape::api {
namespace {

// Single precision cannot tell the centre of a smaller solid from its surface.
constexpr Range kSolidSize = {1e-9, kMaxExtent_m, "m"};

// Each shape: its check, then its message.
Collider Check(const FieldPath& path, const v1::Sphere& sphere, Violations& violations) {
  const auto center_m = CheckPosition(path.Child("center_m"), sphere.center_m(), violations);
  violations.InRange(path.Child("radius_m"), sphere.radius_m(), kSolidSize);
  return SphereAt(center_m, sphere.radius_m());
}

void Fill(const SphereShape& sphere, const RigidTransform& pose, v1::Collider& collider) {
  v1::Sphere& message = *collider.mutable_sphere();
  Append(pose.position_m, message.mutable_center_m());
  message.set_radius_m(sphere.radius_m);
}

Collider Check(const FieldPath& path, const v1::Plane& plane, Violations& violations) {
  const auto point_m = CheckPosition(path.Child("point_m"), plane.point_m(), violations);
  const auto normal = CheckDirection(path.Child("normal"), plane.normal(), violations);
  return PlaneThrough(point_m, normal);
}

void Fill(const PlaneShape& plane, const RigidTransform& pose, v1::Collider& collider) {
  v1::Plane& message = *collider.mutable_plane();
  Append(pose.position_m, message.mutable_point_m());
  Append(Eigen::Vector3d(pose.rotation * plane.normal), message.mutable_normal());
}

Collider Check(const FieldPath& path, const v1::Capsule& capsule, Violations& violations) {
  const auto a_m = CheckPosition(path.Child("a_m"), capsule.a_m(), violations);
  const auto b_m = CheckPosition(path.Child("b_m"), capsule.b_m(), violations);
  violations.InRange(path.Child("radius_m"), capsule.radius_m(), kSolidSize);
  return CapsuleBetween(a_m, b_m, capsule.radius_m());
}

void Fill(const CapsuleShape& capsule, const RigidTransform& pose, v1::Collider& collider) {
  v1::Capsule& message = *collider.mutable_capsule();
  Append(pose * capsule.a_m, message.mutable_a_m());
  Append(pose * capsule.b_m, message.mutable_b_m());
  message.set_radius_m(capsule.radius_m);
}

Collider Check(const FieldPath& path, const v1::Box& box, Violations& violations) {
  const auto center_m = CheckPosition(path.Child("center_m"), box.center_m(), violations);
  const FieldPath extents_path = path.Child("half_extents_m");
  const DoubleList& given_m = box.half_extents_m();
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();
  if (violations.Length(extents_path, static_cast<size_t>(given_m.size()), 3, "x, y, z")) {
    for (int axis = 0; axis < 3; ++axis) {
      violations.InRange(extents_path.At(static_cast<size_t>(axis)), given_m[axis], kSolidSize);
      half_extents_m[axis] = given_m[axis];
    }
  }
  return BoxAt(center_m, half_extents_m,
               CheckOptionalRotation(path.Child("rotation_xyzw"), box.rotation_xyzw(), violations));
}

void Fill(const BoxShape& box, const RigidTransform& pose, v1::Collider& collider) {
  v1::Box& message = *collider.mutable_box();
  Append(pose.position_m, message.mutable_center_m());
  Append(box.half_extents_m, message.mutable_half_extents_m());
  Append(pose.rotation, message.mutable_rotation_xyzw());
}

Collider Check(const FieldPath& path, const v1::Cylinder& cylinder, Violations& violations) {
  const size_t before = violations.count();
  const auto a_m = CheckPosition(path.Child("a_m"), cylinder.a_m(), violations);
  const auto b_m = CheckPosition(path.Child("b_m"), cylinder.b_m(), violations);
  const double length_m = (b_m - a_m).stableNorm();
  if (violations.count() == before) {
    violations.Require(length_m >= kSolidSize.low, path.Child("b_m"), [&] {
      return "is " + NumberText(length_m) + " m from a_m, at least " + NumberText(kSolidSize.low) +
             " m are needed";
    });
  }
  violations.InRange(path.Child("radius_m"), cylinder.radius_m(), kSolidSize);
  return CylinderBetween(a_m, b_m, cylinder.radius_m());
}

void Fill(const CylinderShape& cylinder, const RigidTransform& pose, v1::Collider& collider) {
  v1::Cylinder& message = *collider.mutable_cylinder();
  Append(pose * cylinder.a_m, message.mutable_a_m());
  Append(pose * cylinder.b_m, message.mutable_b_m());
  message.set_radius_m(cylinder.radius_m);
}

// Of bodies: solids of dust to planets of lead. Squares of smaller and larger ones would leave
// double precision with the smallest and largest shapes.
constexpr Range kDensity = {1e-6, 1e6, "kg/m^3"};
constexpr Range kBodyMass = {1e-9, 1e9, "kg"};

void CheckMass(const FieldPath& path, const v1::Collider& message, Collider& collider,
               Violations& violations) {
  if (message.has_density_kg_per_m3()) {
    collider.density_kg_per_m3 = message.density_kg_per_m3();
    violations.InRange(path.Child("density_kg_per_m3"), message.density_kg_per_m3(), kDensity);
  }
  if (message.has_mass_kg()) {
    collider.mass_kg = message.mass_kg();
    violations.InRange(path.Child("mass_kg"), message.mass_kg(), kBodyMass);
  }
  if (message.has_mass_kg() && message.has_density_kg_per_m3()) {
    violations.Add(path.Child("mass_kg"), "is given by density_kg_per_m3: set one of the two");
  }
  if (collider.is_body() && collider.kind() == ShapeKind::kPlane) {
    const char* const field = message.has_mass_kg() ? "mass_kg" : "density_kg_per_m3";
    violations.Add(path.Child(field), "a plane has no mass: it has no end");
  }
}

// The map comes later, from a builder thread (collider_maps.h).
Collider CheckMesh(const FieldPath& path, const v1::Collider& collider,
                   const ClosedMeshLimits& limits, Violations& violations) {
  const FieldPath mesh_path = path.Child("mesh");
  if (CheckMeshArrays(mesh_path, collider.mesh(), violations)) {
    violations.CountInRange(mesh_path.Child("positions_m"), collider.mesh().positions_m().shape(0),
                            4, limits.max_vertices);
    violations.CountInRange(mesh_path.Child("triangles"), collider.mesh().triangles().shape(0), 4,
                            limits.max_triangles);
  }
  return DistanceMapAt(nullptr,
                       CheckTransform(path.Child("transform"), collider.transform(), violations));
}

void Fill(const DistanceMapShape& solid, const RigidTransform& pose, v1::Collider& collider) {
  const TriangleMesh& mesh = solid.map->mesh();
  v1::PackedArray* positions_m = collider.mutable_mesh()->mutable_positions_m();
  positions_m->set_data_type(v1::PackedArray::FLOAT64);
  positions_m->add_shape(static_cast<uint32_t>(mesh.positions_m.size()));
  positions_m->add_shape(3);
  v1::PackedArray* triangles = collider.mutable_mesh()->mutable_triangles();
  triangles->set_data_type(v1::PackedArray::UINT32);
  triangles->add_shape(static_cast<uint32_t>(mesh.triangles.size()));
  triangles->add_shape(3);
  *collider.mutable_transform() = ToProto(pose);
}

// After a violation: a sphere without a radius.
Collider CheckShape(const FieldPath& path, const v1::Collider& collider,
                    const ClosedMeshLimits& limits, Violations& violations) {
  switch (collider.shape_case()) {
    case v1::Collider::kSphere:
      return Check(path.Child("sphere"), collider.sphere(), violations);
    case v1::Collider::kPlane:
      return Check(path.Child("plane"), collider.plane(), violations);
    case v1::Collider::kCapsule:
      return Check(path.Child("capsule"), collider.capsule(), violations);
    case v1::Collider::kBox:
      return Check(path.Child("box"), collider.box(), violations);
    case v1::Collider::kCylinder:
      return Check(path.Child("cylinder"), collider.cylinder(), violations);
    case v1::Collider::kMesh:
      return CheckMesh(path, collider, limits, violations);
    case v1::Collider::SHAPE_NOT_SET:
      violations.Add(
          path, "no shape is set: one of sphere, plane, capsule, box, cylinder, mesh is needed");
      break;
  }
  return {};
}

}  // namespace

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
  const auto body_count = std::count_if(colliders.begin(), colliders.end(), [](const auto& c) {
    return c.has_mass_kg() || c.has_density_kg_per_m3();
  });
  violations.Require(static_cast<uint64_t>(body_count) <= limits.max_bodies_per_cloth, path, [&] {
    return "has " + std::to_string(body_count) + " with a mass, at most " +
           std::to_string(limits.max_bodies_per_cloth) + " are allowed";
  });
  for (int k = 0; k < colliders.size(); ++k) {
    const FieldPath here = path.At(k);
    if (colliders[k].has_transform() && !colliders[k].has_mesh()) {
      violations.Add(here.Child("transform"),
                     "belongs to mesh: the other shapes have a position of their own");
    }
    result.push_back(CheckShape(here, colliders[k], limits.collider_mesh, violations));
    CheckMass(here, colliders[k], result.back(), violations);
    const auto index = static_cast<uint32_t>(k), count = static_cast<uint32_t>(colliders.size());
    const FieldPath joints_path = here.Child("joints");
    result.back().joints =
        CheckJoints(joints_path, colliders[k].joints(), index, count, violations);
    violations.Require(colliders[k].joints().empty() || result.back().is_body(), joints_path, [] {
      return "belong to bodies: set mass_kg or density_kg_per_m3, or give the joint to the other "
             "side";
    });
  }
  return result;
}

v1::Collider ToProto(const Collider& collider) {
  v1::Collider message;
  std::visit([&](const auto& shape) { Fill(shape, collider.pose, message); }, collider.shape);
  if (collider.density_kg_per_m3 > 0) message.set_density_kg_per_m3(collider.density_kg_per_m3);
  if (collider.mass_kg > 0) message.set_mass_kg(collider.mass_kg);
  for (const BodyJoint& joint : collider.joints) *message.add_joints() = ToProto(joint);
  return message;
}

}  // namespace drape::api
