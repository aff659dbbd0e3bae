#include "server/api/joint_message.h"

#include <string>

#include "server/api/geometry_message.h"
#include "server/scene/description_checks.h"

namespace drape::api {
namespace {

// The solver takes all joints of bodies that hang together at once.
constexpr int kMaxJointsPerCollider = 8;
constexpr int kMaxPulleysPerRope = 8;
constexpr Range kRopeLength = {1e-6, kMaxExtent_m, "m"};
// By which clients may round a rope that is taut at the start [-].
constexpr double kRopeRounding = 1e-9;

bool CheckCount(const FieldPath& path, int count, int most, Violations& violations) {
  return violations.Require(count <= most, path, [&] {
    return "has " + std::to_string(count) + " elements, at most " + std::to_string(most) +
           " are allowed";
  });
}

std::vector<Eigen::Vector3d> CheckPulleys(const FieldPath& path, const DoubleList& pulleys_m,
                                          Violations& violations) {
  std::vector<Eigen::Vector3d> result;
  if (!violations.Require(pulleys_m.size() % 3 == 0, path,
                          [&] {
                            return "has " + std::to_string(pulleys_m.size()) +
                                   " numbers, 3 per pulley are needed";
                          }) ||
      !CheckCount(path, pulleys_m.size() / 3, kMaxPulleysPerRope, violations) ||
      !CheckAllWithin(path, pulleys_m, kMaxExtent_m, "m", violations)) {
    return result;
  }
  for (int k = 0; k < pulleys_m.size(); k += 3) {
    result.emplace_back(pulleys_m[k], pulleys_m[k + 1], pulleys_m[k + 2]);
  }
  return result;
}

void CheckRope(const FieldPath& path, const v1::BodyJoint& message, BodyJoint& joint,
               Violations& violations) {
  const size_t before = violations.count();
  joint.rope_length_m = message.rope_length_m();
  const FieldPath length_path = path.Child("rope_length_m");
  violations.InRange(length_path, message.rope_length_m(), kRopeLength);
  joint.other_point_m =
      CheckPosition(path.Child("other_point_m"), message.other_point_m(), violations);
  joint.pulleys_m = CheckPulleys(path.Child("pulleys_m"), message.pulleys_m(), violations);
  if (violations.count() > before) return;
  const double way_m = RopeWay_m(joint, joint.point_m, joint.other_point_m);
  violations.Require(way_m <= message.rope_length_m() * (1 + kRopeRounding), length_path, [&] {
    return NumberText(message.rope_length_m()) + " m is shorter than the way from point_m to " +
           "other_point_m, " + NumberText(way_m) + " m";
  });
}

void RefuseRopeFields(const FieldPath& path, const v1::BodyJoint& message, Violations& violations) {
  const auto refuse = [&](const char* field) {
    violations.Add(path.Child(field), "belongs to ropes: set rope_length_m, or leave it out");
  };
  if (!message.other_point_m().empty()) refuse("other_point_m");
  if (!message.pulleys_m().empty()) refuse("pulleys_m");
}

}  // namespace

std::vector<BodyJoint> CheckJoints(const FieldPath& path,
                                   const google::protobuf::RepeatedPtrField<v1::BodyJoint>& joints,
                                   uint32_t collider, uint32_t collider_count,
                                   Violations& violations) {
  std::vector<BodyJoint> result;
  if (!CheckCount(path, joints.size(), kMaxJointsPerCollider, violations)) return result;
  for (int j = 0; j < joints.size(); ++j) {
    const v1::BodyJoint& message = joints[j];
    const FieldPath here = path.At(static_cast<size_t>(j));
    BodyJoint& joint = result.emplace_back();
    joint.point_m = joint.other_point_m =
        CheckPosition(here.Child("point_m"), message.point_m(), violations);
    if (message.has_collider()) {
      joint.collider = message.collider();
      violations.Require(
          message.collider() < collider_count && message.collider() != collider,
          here.Child("collider"), [&] {
            return std::to_string(message.collider()) +
                   (message.collider() == collider
                        ? " is the collider that the joint belongs to: another one is needed"
                        : " is not below the number of colliders, " +
                              std::to_string(collider_count));
          });
    }
    if (message.has_rope_length_m()) {
      CheckRope(here, message, joint, violations);
    } else {
      RefuseRopeFields(here, message, violations);
    }
  }
  return result;
}

v1::BodyJoint ToProto(const BodyJoint& joint) {
  v1::BodyJoint message;
  Append(joint.point_m, message.mutable_point_m());
  if (joint.collider) message.set_collider(*joint.collider);
  if (!joint.is_rope()) return message;
  message.set_rope_length_m(*joint.rope_length_m);
  Append(joint.other_point_m, message.mutable_other_point_m());
  for (const Eigen::Vector3d& pulley_m : joint.pulleys_m) {
    Append(pulley_m, message.mutable_pulleys_m());
  }
  return message;
}

}  // namespace drape::api
