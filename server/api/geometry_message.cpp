#include "server/api/geometry_message.h"

#include <cmath>
#include <limits>

#include "server/scene/description_checks.h"

namespace drape::api {
namespace {

// Unit vector along `v`, without overflow or underflow. `v` must not be zero. A unit vector stays
// as it is, so that what a client reads back and sends again keeps its bits.
Eigen::VectorXd UnitVector(const Eigen::VectorXd& v) {
  constexpr double kFewRoundings = 16 * std::numeric_limits<double>::epsilon();
  if (std::abs(v.squaredNorm() - 1) <= kFewRoundings) return v;
  const Eigen::VectorXd scaled = v / v.cwiseAbs().maxCoeff();
  return scaled / scaled.norm();
}

}  // namespace

Eigen::Vector3d CheckPosition(const FieldPath& path, const DoubleList& position_m,
                              Violations& violations) {
  return CheckVector3(path, position_m, kMaxExtent_m, "m", violations)
      .value_or(Eigen::Vector3d::Zero());
}

Eigen::Vector3d CheckDirection(const FieldPath& path, const DoubleList& direction,
                               Violations& violations) {
  const auto given = CheckVector3(path, direction, kMaxCoefficient, "", violations);
  if (!given || !violations.Require(!given->isZero(0), path, [] {
        return "(0, 0, 0) has no direction: a length > 0 is needed";
      })) {
    return Eigen::Vector3d::UnitY();
  }
  return UnitVector(*given);
}

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

Eigen::Quaterniond CheckOptionalRotation(const FieldPath& path, const DoubleList& xyzw,
                                         Violations& violations) {
  if (xyzw.empty() || !violations.Length(path, static_cast<size_t>(xyzw.size()), 4, "x, y, z, w") ||
      !CheckAllWithin(path, xyzw, kMaxCoefficient, "", violations)) {
    return Eigen::Quaterniond::Identity();
  }
  return CheckRotation(path, {xyzw[0], xyzw[1], xyzw[2], xyzw[3]}, violations);
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

void Append(const Eigen::Vector3d& v, DoubleList* list) {
  list->Add(v.begin(), v.end());
}

void Append(const Eigen::Quaterniond& rotation, DoubleList* list) {
  const Eigen::Vector4d& xyzw = rotation.coeffs();
  list->Add(xyzw.begin(), xyzw.end());
}

v1::Transform ToProto(const RigidTransform& transform) {
  v1::Transform message;
  Append(transform.position_m, message.mutable_position_m());
  Append(transform.rotation, message.mutable_rotation_xyzw());
  return message;
}

}  // namespace drape::api
