// Vectors, rotations and transforms of messages, in and out. Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/description.h"

namespace drape::api {

// A position [m]; the origin after a violation.
Eigen::Vector3d CheckPosition(const FieldPath& path, const DoubleList& position_m,
                              Violations& violations);
// The unit vector along a direction of any length > 0; +y after a violation. A unit vector keeps
// its bits.
Eigen::Vector3d CheckDirection(const FieldPath& path, const DoubleList& direction,
                               Violations& violations);
// `values`: x, y, z, w. A zero quaternion has no direction and is refused; others are normalised.
Eigen::Quaterniond CheckRotation(const FieldPath& path, const Eigen::Vector4d& values,
                                 Violations& violations);
// The same of a list; empty: no rotation.
Eigen::Quaterniond CheckOptionalRotation(const FieldPath& path, const DoubleList& xyzw,
                                         Violations& violations);
RigidTransform CheckTransform(const FieldPath& path, const v1::Transform& transform,
                              Violations& violations);

void Append(const Eigen::Vector3d& v, DoubleList* list);
// As x, y, z, w.
void Append(const Eigen::Quaterniond& rotation, DoubleList* list);
v1::Transform ToProto(const RigidTransform& transform);

}  // namespace drape::api
