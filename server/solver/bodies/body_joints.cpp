#include "server/solver/bodies/body_joints.h"

#include <algorithm>
#include <limits>

#include "server/core/check.h"
#include "server/solver/solver_constants.h"

namespace drape::bodies {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// What a joint may be off, in roundings of its coordinates [-].
constexpr double kJointRoundOffs = 64;
// Shorter parts of a rope have no direction [m].
constexpr double kMinPart_m = 1e-12;

Vector3d DirectionOf(const Vector3d& way_m) {
  const double length_m = way_m.norm();
  if (length_m < kMinPart_m) return Vector3d::Zero();
  return way_m / length_m;
}

Vector3d GapOf(const BodyJoint& joint, const Vector3d& end_m, const Vector3d& other_m) {
  if (!joint.is_rope()) return end_m - other_m;
  return {*joint.rope_length_m - RopeWay_m(joint, end_m, other_m), 0, 0};
}

double SlackOf(const BodyJoints::Joint& joint) {
  double size_m = joint.described->rope_length_m.value_or(0);
  for (const BodyJoints::End& end : joint.ends) {
    size_m += end.at_end_m.cwiseAbs().sum() + end.arm_m.cwiseAbs().sum();
  }
  return kJointRoundOffs * std::numeric_limits<double>::epsilon() * size_m;
}

// Of an end, where its collider has that motion at the moment.
Vector3d PlaceOf(const BodyJoints::Joint& joint, size_t e,
                 const std::vector<PlacedCollider>& placed, RigidMotion PlacedCollider::*motion) {
  const Vector3d& described_m = e == 0 ? joint.described->point_m : joint.described->other_point_m;
  const std::optional<size_t>& collider = joint.ends[e].collider;
  return collider ? (placed[*collider].*motion).PlaceOf(described_m) : described_m;
}

}  // namespace

BodyJoints::BodyJoints(const std::vector<PlacedCollider>& placed) {
  for (size_t c = 0; c < placed.size(); ++c) {
    for (const BodyJoint& described : placed[c].collider->joints) {
      DRAPE_CHECK(placed[c].body, "joints belong to bodies");
      DRAPE_CHECK(!described.collider || *described.collider < placed.size(), "of the cloth");
      Joint& joint = joints_.emplace_back();
      joint.described = &described;
      joint.ends[0].collider = c;
      if (described.collider) joint.ends[1].collider = *described.collider;
    }
  }
}

bool BodyJoints::AreTied(size_t a, size_t b) const {
  return std::ranges::any_of(joints_, [&](const Joint& joint) {
    if (joint.described->is_rope() || !joint.ends[1].collider) return false;
    const size_t c = *joint.ends[0].collider, d = *joint.ends[1].collider;
    return (c == a && d == b) || (c == b && d == a);
  });
}

void BodyJoints::Begin(const std::vector<PlacedCollider>& placed, double seconds) {
  seconds_ = seconds;
  for (Joint& joint : joints_) {
    for (size_t e = 0; e < 2; ++e) {
      joint.ends[e].at_start_m = PlaceOf(joint, e, placed, &PlacedCollider::start);
      joint.ends[e].given = {};
    }
    joint.acts = false;
    joint.impulse.setZero();
    SetFloor(joint);
    SetArms(placed, joint, When::kSubstep);
  }
}

// What is open when the substep begins closes at most as fast as what starts inside a collider
// leaves it.
void BodyJoints::SetFloor(Joint& joint) const {
  const double closes_m = kMaxDepenetrationSpeed_m_per_s * seconds_;
  const Vector3d gap_m =
      GapOf(*joint.described, joint.ends[0].at_start_m, joint.ends[1].at_start_m);
  const double open_m = joint.described->is_rope() ? std::max(-gap_m.x(), 0.0) : gap_m.norm();
  joint.floor_m =
      open_m > closes_m ? Vector3d((open_m - closes_m) * gap_m / gap_m.norm()) : Vector3d::Zero();
}

void BodyJoints::SetArms(const std::vector<PlacedCollider>& placed, Joint& joint, When when) const {
  const auto place_of = [&](const End& end) {
    return when == When::kSubstep ? end.at_start_m : end.at_end_m;
  };
  std::array places_m{place_of(joint.ends[0]), place_of(joint.ends[1])};
  if (joint.described->is_rope()) {
    const std::vector<Vector3d>& pulleys_m = joint.described->pulleys_m;
    const Vector3d next_m = pulleys_m.empty() ? places_m[1] : pulleys_m.front();
    const Vector3d last_m = pulleys_m.empty() ? places_m[0] : pulleys_m.back();
    joint.ends[0].push.col(0) = DirectionOf(next_m - places_m[0]);
    joint.ends[1].push.col(0) = DirectionOf(last_m - places_m[1]);
  } else {
    joint.ends[0].push = Matrix3d::Identity();
    joint.ends[1].push = -Matrix3d::Identity();
    // Of two bodies in one place, so that their angular momentum together stays as it is.
    if (joint.ends[1].collider) places_m.fill((places_m[0] + places_m[1]) / 2);
  }
  for (size_t e = 0; e < 2; ++e) {
    End& end = joint.ends[e];
    if (!end.collider) continue;
    const PlacedCollider& its = placed[*end.collider];
    end.arm_m = places_m[e] - (when == When::kSubstep ? its.start : its.end).position_m;
  }
}

bool BodyJoints::Look(const std::vector<PlacedCollider>& placed, When when) {
  bool is_off = false;
  for (Joint& joint : joints_) {
    for (size_t e = 0; e < 2; ++e) {
      joint.ends[e].at_end_m = PlaceOf(joint, e, placed, &PlacedCollider::end);
    }
    joint.gap_m = GapOf(*joint.described, joint.ends[0].at_end_m, joint.ends[1].at_end_m);
    const double slack_m = SlackOf(joint);
    const Vector3d off_m = joint.gap_m - joint.floor_m;
    if (!joint.described->is_rope()) {
      joint.acts = true;
      is_off |= off_m.norm() > slack_m;
    } else {
      // In the end also what has not pulled.
      const bool has_direction = joint.ends[0].push.col(0) != Vector3d::Zero();
      joint.acts |= off_m.x() < (when == When::kEnd ? 2 * slack_m : 0) && has_direction;
      const bool pulls = joint.impulse.x() > 0;
      is_off |= joint.acts && (pulls ? std::abs(off_m.x()) : -off_m.x()) > slack_m;
    }
    if (when != When::kSubstep) SetArms(placed, joint, When::kEnd);
  }
  return is_off;
}

Vector3d BodyJoints::VelocityOf(const std::vector<PlacedCollider>& placed,
                                const Joint& joint) const {
  Vector3d velocity = Vector3d::Zero();
  for (const End& end : joint.ends) {
    if (!end.collider) continue;
    velocity += end.push.transpose() * placed[*end.collider].VelocityAt(end.arm_m);
  }
  return velocity;
}

void BodyJoints::FindDemands(const std::vector<PlacedCollider>& placed, When when) {
  for (Joint& joint : joints_) {
    joint.demanded_m_per_s.setZero();
    if (!joint.acts) {
      joint.impulse.setZero();
      joint.guesses.fill(Vector3d::Zero());
    }
    if (when == When::kEnd) continue;
    joint.demanded_m_per_s = -(joint.gap_m - joint.floor_m) / seconds_;
    if (when == When::kSubstep) joint.demanded_m_per_s += VelocityOf(placed, joint);
  }
}

void BodyJoints::DropImpulses() {
  for (Joint& joint : joints_) {
    joint.acts = false;
    joint.impulse.setZero();
  }
}

void BodyJoints::SetImpulse(size_t j, const Vector3d& impulse, When when) {
  joints_[j].impulse = joints_[j].guesses[static_cast<size_t>(when)] = impulse;
}

void BodyJoints::FindMoments() {
  for (Joint& joint : joints_) {
    for (End& end : joint.ends) {
      end.given.linear = end.push * joint.impulse;
      end.given.angular = end.arm_m.cross(end.given.linear);
    }
  }
}

void BodyJoints::AddTo(std::vector<Momentum>& sums) const {
  for (const Joint& joint : joints_) {
    for (const End& end : joint.ends) {
      if (end.collider) sums[*end.collider].Add(end.given);
    }
  }
}

}  // namespace drape::bodies
