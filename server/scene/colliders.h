// Shapes a cloth can touch, as implicit functions (paper section 4.1).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <variant>

#include "server/scene/description.h"
#include "server/scene/rigid_motion.h"

namespace drape {

class DistanceMap;  // scene/distance_map.h

struct SphereCollider {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double radius_m = 0;  // > 0
};

// Solid on the side away from the normal.
struct PlaneCollider {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // unit
};

// All points no farther than radius_m from the segment between a_m and b_m; a sphere where they
// coincide.
struct CapsuleCollider {
  Eigen::Vector3d a_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_m = Eigen::Vector3d::Zero();
  double radius_m = 0;  // > 0
};

// A solid cuboid. Inside, distance and normal are those of the nearest face (of equally near ones
// the first in the order x, y, z; between two opposite ones the positive side); outside, those of
// the nearest point.
struct BoxCollider {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();      // each > 0, along the box's axes
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit; takes x, y, z to the axes
};

// A solid bounded by a closed mesh, by the samples of its signed distance: distance and normal are
// those of DistanceMap::SurfaceAt in the mesh's frame, off by at most the map's error bound. Where
// the distance has no gradient the normal is the mesh's +y.
struct DistanceMapCollider {
  std::shared_ptr<const DistanceMap> map;  // shared by all colliders of this mesh; never null
  RigidTransform transform;                // places the mesh
};

using Collider = std::variant<SphereCollider, PlaneCollider, CapsuleCollider, BoxCollider,  // exact
                              DistanceMapCollider>;  // sampled

// The point of a collider about which it turns unless another one is given: the centre of a sphere
// or box, the middle of a capsule, the point of a plane, the origin of a mesh.
Eigen::Vector3d CentreOf(const Collider& collider);

// The shape at the pose of the motion at time 0.
Collider Moved(const Collider& collider, const RigidMotion& motion);

// The outward normal on the segment itself, where the distance has no gradient: +y made
// perpendicular to the segment; +x for a steep one (more than 0.9 of it along y); +y for a point,
// as at a sphere's centre.
Eigen::Vector3d NormalOnSegment(const CapsuleCollider& capsule);

}  // namespace drape
