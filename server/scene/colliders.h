// Shapes a cloth can touch, as implicit functions (Bender et al. 2009, section 4.1). A collider is
// a shape in a frame of its own and the pose of that frame. Everything that depends on the shape is
// declared here: other code calls these functions, but for the gaps in single precision
// (contact_math-inl.h, shaders/lib/contact.glsl), messages (api/collider_message) and drawing.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "server/scene/body_joint.h"
#include "server/scene/description.h"
#include "server/scene/rigid_motion.h"
#include "server/scene/surface_distance.h"

namespace drape {

class DistanceMap;  // scene/distance_map.h

// Around the origin.
struct SphereShape {
  double radius_m = 0;  // > 0

  bool operator==(const SphereShape&) const = default;
};

// Through the origin; solid on the side away from the normal.
struct PlaneShape {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // unit

  bool operator==(const PlaneShape&) const = default;
};

// All points no farther than radius_m from the segment between a_m and b_m; a sphere where they
// coincide. It and the cylinder keep their two ends in place of a pose and a length: answers of the
// server name the ends to the bit as the client described them.
struct CapsuleShape {
  Eigen::Vector3d a_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_m = Eigen::Vector3d::Zero();
  double radius_m = 0;  // > 0

  bool operator==(const CapsuleShape&) const = default;
};

// All points between the planes through a_m and b_m, perpendicular to the line between them, that
// are no farther than radius_m from it. Inside, distance and normal are those of the side or the
// nearer end, whichever is nearest (of equals the side; halfway between the ends that at b_m);
// outside, those of the nearest point.
struct CylinderShape {
  Eigen::Vector3d a_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_m = Eigen::Vector3d::Zero();  // not at a_m
  double radius_m = 0;                            // > 0

  bool operator==(const CylinderShape&) const = default;
};

// A solid cuboid around the origin. Inside, distance and normal are those of the nearest face (of
// equally near ones the first in the order x, y, z; between two opposite ones the positive side);
// outside, those of the nearest point.
struct BoxShape {
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();  // each > 0

  bool operator==(const BoxShape&) const = default;
};

// A solid bounded by a closed mesh, by the samples of its signed distance: distance and normal are
// those of DistanceMap::SurfaceAt, off by at most the map's error bound. The normal is +y where the
// distance has no gradient.
struct DistanceMapShape {
  std::shared_ptr<const DistanceMap> map;  // shared by all colliders of this mesh; never null

  bool operator==(const DistanceMapShape&) const = default;
};

// The alternatives in the order of ShapeKind.
using Shape =
    std::variant<SphereShape, PlaneShape, CapsuleShape, BoxShape, DistanceMapShape, CylinderShape>;

enum class ShapeKind : uint8_t { kSphere, kPlane, kCapsule, kBox, kDistanceMap, kCylinder };

// [ShapeKind]
inline constexpr std::array<std::string_view, 6> kShapeNames = {
    "sphere", "plane", "capsule", "box", "distance_map", "cylinder"};
static_assert(std::variant_size_v<Shape> == kShapeNames.size());

struct Collider {
  Shape shape;
  RigidTransform pose{};
  // At most one of the two is above 0: then it is a rigid body (body_mass.h), which gravity and
  // contacts move. Not of a plane.
  double density_kg_per_m3 = 0;
  double mass_kg = 0;
  std::vector<BodyJoint> joints{};  // of a body

  ShapeKind kind() const { return static_cast<ShapeKind>(shape.index()); }
  bool is_body() const { return density_kg_per_m3 > 0 || mass_kg > 0; }

  bool operator==(const Collider&) const = default;
};

// Whether any of them is a body.
bool HasBodies(std::span<const Collider> colliders);

Collider SphereAt(const Eigen::Vector3d& center_m, double radius_m);
// `normal`: unit.
Collider PlaneThrough(const Eigen::Vector3d& point_m, const Eigen::Vector3d& normal);
Collider CapsuleBetween(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m, double radius_m);
Collider BoxAt(const Eigen::Vector3d& center_m, const Eigen::Vector3d& half_extents_m,
               const Eigen::Quaterniond& rotation = Eigen::Quaterniond::Identity());
Collider CylinderBetween(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m, double radius_m);
Collider DistanceMapAt(std::shared_ptr<const DistanceMap> map, const RigidTransform& pose = {});

// The map of a collider that is one, else null.
std::shared_ptr<const DistanceMap> MapOf(const Collider& collider);

// The point of a collider about which it turns unless another one is given: the middle of a
// capsule or cylinder, the origin of the frame of other shapes (the centre of a sphere or box, the
// point of a plane).
Eigen::Vector3d CentreOf(const Collider& collider);

// The collider at the pose of the motion at time 0.
Collider Moved(const Collider& collider, const RigidMotion& motion);

// Half of its smallest width; of a map where it is widest, at least half a cell. Infinite of a
// plane [m].
double HalfWidth_m(const Collider& collider);

// Distance and outward normal at q; at a sphere's centre the normal is +y.
SurfaceDistance SurfaceOf(const Collider& collider, const Eigen::Vector3d& q);

// The outward normal of a capsule on its segment, or of a cylinder's side on its axis, where the
// distance has no gradient: +y made perpendicular to the segment; +x for a steep one (more than 0.9
// of it along y); +y for a point.
Eigen::Vector3d NormalOnSegment(const Eigen::Vector3d& segment_m);

// From what solvers in single precision compute the gap of a collider.
struct ColliderNumbers {
  double radius_m = 0;  // of a sphere, capsule or cylinder
  // Centre of a sphere, box or cylinder, point of a plane nearest to the origin, end a of a
  // capsule, first sample of a map.
  Eigen::Vector3d point_m;
  // Normal of a plane, end b - end a of a capsule [m], half extents of a box [m], radius and half
  // length of a cylinder [m].
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  // In columns: of a box or map its axes; of a capsule [0]: NormalOnSegment; of a cylinder [0]: its
  // axis, [1]: NormalOnSegment.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
};
ColliderNumbers NumbersOf(const Collider& collider);

}  // namespace drape
