// Motions of pins, grips, lengths and colliders, in and out of messages. Pure.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>
#include <vector>

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/field_checks.h"
#include "server/api/over_column.h"
#include "server/api/rest_length_validation.h"
#include "server/scene/description_checks.h"
#include "server/scene/rigid_motion.h"
#include "server/scheduler/motion.h"
#include "server/scheduler/track.h"
#include "server/solver/solver_constants.h"

namespace drape::api {

// Pins and grips go where clients send them, and cloth frames are within the same bounds.
inline constexpr double kMaxTarget_m = 4 * kMaxExtent_m;
// Colliders may travel for years.
inline constexpr double kMaxPlace_m = kMaxMagnitude;
inline constexpr double kMaxMotionStart_s = 1e15;
inline constexpr double kLargestRoundingOfUnit = 1e-9;

// A row of v1::RuntimeSnapshot::Motions.starts or goals.
template <class Value>
inline constexpr size_t kNumbersOf = 1;
template <>
inline constexpr size_t kNumbersOf<Eigen::Vector3d> = 3;
template <>
inline constexpr size_t kNumbersOf<RigidMotion> = 16;

inline void AppendValue(double value, DoubleList* list) {
  list->Add(value);
}
inline void AppendValue(const Eigen::Vector3d& value, DoubleList* list) {
  list->Add(value.begin(), value.end());
}
inline void AppendValue(const RigidMotion& value, DoubleList* list) {
  AppendValue(value.pivot_m, list);
  AppendValue(value.position_m, list);
  const Eigen::Vector4d& xyzw = value.rotation.coeffs();
  list->Add(xyzw.begin(), xyzw.end());
  AppendValue(value.velocity_m_per_s, list);
  AppendValue(value.angular_velocity_rad_per_s, list);
}

inline void ReadValue(const double* numbers, double& value) {
  value = *numbers;
}
inline void ReadValue(const double* numbers, Eigen::Vector3d& value) {
  value = Eigen::Vector3d(numbers);
}
inline void ReadValue(const double* numbers, RigidMotion& value) {
  value.pivot_m = Eigen::Vector3d(numbers);
  value.position_m = Eigen::Vector3d(numbers + 3);
  value.rotation.coeffs() = Eigen::Vector4d(numbers + 6);
  value.velocity_m_per_s = Eigen::Vector3d(numbers + 10);
  value.angular_velocity_rad_per_s = Eigen::Vector3d(numbers + 13);
}

// NaN is not within anything.
inline bool IsWithin(const Eigen::Vector3d& v, double most) {
  return (v.array().abs() <= most).all();
}
inline bool IsLegal(double length_m) {
  return length_m >= kMinRestLength_m / kMaxLengthScale &&
         length_m <= kMaxExtent_m * kMaxLengthScale;
}
inline bool IsLegal(const Eigen::Vector3d& place_m) {
  return IsWithin(place_m, kMaxTarget_m);
}
inline bool IsLegal(const RigidMotion& motion) {
  return IsWithin(motion.pivot_m, kMaxTarget_m) && IsWithin(motion.position_m, kMaxPlace_m) &&
         std::abs(motion.rotation.squaredNorm() - 1) <= kLargestRoundingOfUnit &&
         IsWithin(motion.velocity_m_per_s, kMaxSpeed_m_per_s) &&
         IsWithin(motion.angular_velocity_rad_per_s, kMaxTurn_rad_per_s);
}

template <class Value>
void AppendMotion(const Motion<Value>& motion, v1::RuntimeSnapshot::Motions& message) {
  AppendValue(motion.start, message.mutable_starts());
  AppendValue(motion.goal.value_or(motion.start), message.mutable_goals());
  message.add_have_goals(motion.goal.has_value());
  message.add_start_times_s(motion.start_s);
  message.add_over_s(motion.over_s);
}

template <class Value>
v1::RuntimeSnapshot::Motions ToMessage(const Track<Value>& track) {
  v1::RuntimeSnapshot::Motions message;
  for (size_t k = 0; k < track.size(); ++k) AppendMotion(track.motion(k), message);
  message.set_is_settled(track.is_settled());
  message.set_is_repeated(track.is_repeated());
  return message;
}

// `count` motions; fewer after a violation.
template <class Value>
std::vector<Motion<Value>> CheckMotions(const FieldPath& path,
                                        const v1::RuntimeSnapshot::Motions& message, size_t count,
                                        bool need_goals, Violations& violations) {
  constexpr size_t kNumbers = kNumbersOf<Value>;
  const auto length = [&](const char* name, int actual, size_t expected) {
    return violations.Length(path.Child(name), static_cast<size_t>(actual), expected,
                             "as the cloth needs");
  };
  std::vector<Motion<Value>> motions;
  if (!(length("starts", message.starts_size(), kNumbers * count) &
        length("goals", message.goals_size(), kNumbers * count) &
        length("have_goals", message.have_goals_size(), count) &
        length("start_times_s", message.start_times_s_size(), count) &
        length("over_s", message.over_s_size(), count))) {
    return motions;
  }
  for (size_t k = 0; k < count && !violations.is_full(); ++k) {
    const int row = static_cast<int>(k);
    Motion<Value> motion{};
    ReadValue(message.starts().data() + kNumbers * k, motion.start);
    bool is_legal = IsLegal(motion.start);
    if (message.have_goals(row)) {
      Value goal;
      ReadValue(message.goals().data() + kNumbers * k, goal);
      is_legal &= IsLegal(goal);
      motion.goal = goal;
    } else {
      is_legal &= !need_goals;
    }
    motion.start_s = message.start_times_s(row);
    motion.over_s = message.over_s(row);
    is_legal &= std::abs(motion.start_s) <= kMaxMotionStart_s;
    is_legal &= Range{0, kMaxMotion_s}.Contains(motion.over_s);
    violations.Require(is_legal, path.At(k), [] { return "is no motion of a cloth"; });
    motions.push_back(std::move(motion));
  }
  return motions;
}

template <class Value>
Track<Value> CheckTrack(const FieldPath& path, const v1::RuntimeSnapshot::Motions& message,
                        size_t count, bool need_goals, Violations& violations) {
  Track<Value> track;
  auto motions = CheckMotions<Value>(path, message, count, need_goals, violations);
  track.Restore(std::move(motions), message.is_settled(), message.is_repeated());
  return track;
}

}  // namespace drape::api
