#include "server/solver/bodies/point_contacts.h"

#include <algorithm>

#include "server/solver/bodies/rebound.h"
#include "server/solver/solver_constants.h"

namespace drape::bodies {

using Eigen::Vector3d;

namespace {

bool IsRound(const Collider& collider) {
  return collider.kind() == ShapeKind::kSphere || collider.kind() == ShapeKind::kCapsule;
}

// Of the surface of `solid` over that of `other` at the contact.
template <class Touch>
Vector3d RelativeVelocity(const PlacedCollider& solid, const PlacedCollider& other,
                          const Touch& touch) {
  return solid.VelocityAt(touch.arm_of_solid) - other.VelocityAt(touch.arm_of_other);
}

template <class Touch>
double MobilityAlong(const PlacedCollider& solid, const PlacedCollider& other, const Touch& touch,
                     const Vector3d& n) {
  return solid.MobilityAlong(n, touch.arm_of_solid) + other.MobilityAlong(n, touch.arm_of_other);
}

// The impulse that stops what slides [N s].
template <class Touch>
Vector3d Stopping(const PlacedCollider& solid, const PlacedCollider& other, const Touch& touch,
                  const Vector3d& sliding) {
  const double speed = sliding.norm();
  if (speed == 0) return Vector3d::Zero();
  return -sliding / MobilityAlong(solid, other, touch, sliding / speed);
}

}  // namespace

PointContacts::PointContacts(const std::vector<PlacedCollider>& placed) : given_(placed.size()) {
  std::vector<BodyPoints> points;
  for (const PlacedCollider& each : placed) points.push_back(PointsOf(*each.collider));
  const auto add = [&](size_t solid, size_t other) {
    for (const Vector3d& place : points[solid].places_m) {
      contacts_.push_back({solid, other, place, points[solid].radius_m});
    }
  };
  for (size_t a = 0; a < placed.size(); ++a) {
    for (size_t b = a + 1; b < placed.size(); ++b) {
      if (!placed[a].body && !placed[b].body) continue;
      // What is round is all there in its own points.
      const bool is_a_round = IsRound(*placed[a].collider);
      if (is_a_round || points[a].places_m.size() > 0) add(a, b);
      if (!is_a_round) add(b, a);
    }
  }
}

void PointContacts::Begin(const std::vector<PlacedCollider>& placed, const BodyNumbers& numbers,
                          double seconds) {
  seconds_ = seconds;
  for (Contact& contact : contacts_) {
    const PlacedCollider& solid = placed[contact.solid];
    const PlacedCollider& other = placed[contact.other];
    const Vector3d place = solid.start.PlaceOf(contact.place_m);
    const SurfaceDistance surface = other.SurfaceAtStart(place);
    contact.start_gap = surface.distance_m - contact.radius_m;
    contact.normal = 0;
    contact.tangent.setZero();
    contact.rebound = 0;
    if (numbers.restitution == 0) continue;
    const Vector3d& n = surface.outward;
    const Vector3d touching = place - contact.radius_m * n;
    const Vector3d relative = solid.start.VelocityAt(touching) - other.start.VelocityAt(touching);
    const double fall = FallOf(solid, other) * numbers.gravity_m_per_s2.dot(n);
    contact.rebound = ReboundSpeed(contact.start_gap, relative.dot(n), fall, numbers);
  }
}

PointContacts::Touch PointContacts::TouchAtEnd(const std::vector<PlacedCollider>& placed,
                                               const Contact& contact, bool is_over) const {
  const PlacedCollider& solid = placed[contact.solid];
  const PlacedCollider& other = placed[contact.other];
  const Vector3d place = solid.end.PlaceOf(contact.place_m);
  const SurfaceDistance surface = other.SurfaceAtEnd(place);
  Touch touch{.gap = surface.distance_m - contact.radius_m, .n = surface.outward};
  if (solid.body && other.body && !is_over) {
    // From where both start, so that their angular momentum together stays as it is.
    const Vector3d at_start = solid.start.PlaceOf(contact.place_m) - contact.radius_m * touch.n;
    touch.arm_of_solid = at_start - solid.start.position_m;
    touch.arm_of_other = at_start - other.start.position_m;
  } else {
    const Vector3d at_end = place - contact.radius_m * touch.n;
    touch.arm_of_solid = at_end - solid.end.position_m;
    touch.arm_of_other = at_end - other.end.position_m;
  }
  return touch;
}

void PointContacts::Apply(std::vector<PlacedCollider>& placed, const Contact& contact,
                          const Touch& touch, const Vector3d& impulse) {
  placed[contact.solid].Push(impulse, touch.arm_of_solid);
  placed[contact.other].Push(-impulse, touch.arm_of_other);
  const auto give = [&](size_t c, const Vector3d& its, const Vector3d& arm) {
    given_[c].impulse_n_s += its;
    given_[c].angular_impulse_n_m_s += arm.cross(its);
  };
  give(contact.solid, impulse, touch.arm_of_solid);
  give(contact.other, -impulse, touch.arm_of_other);
}

double PointContacts::Solve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers) {
  double largest_change = 0;
  for (Contact& contact : contacts_) {
    PlacedCollider& solid = placed[contact.solid];
    PlacedCollider& other = placed[contact.other];
    const Touch touch = TouchAtEnd(placed, contact, false);
    if (touch.gap >= 0 && contact.normal == 0) continue;
    const double mobility = MobilityAlong(solid, other, touch, touch.n);
    const double floor =
        std::min(0.0, contact.start_gap + kMaxDepenetrationSpeed_m_per_s * seconds_);
    const double normal =
        std::max(contact.normal - (touch.gap - floor) / (seconds_ * mobility), 0.0);
    largest_change = std::max(largest_change, std::abs(normal - contact.normal) * mobility);
    Apply(placed, contact, touch, (normal - contact.normal) * touch.n);
    contact.normal = normal;
    if (numbers.friction_static == 0) continue;
    const Vector3d sliding = Tangential(RelativeVelocity(solid, other, touch), touch.n);
    const Vector3d tangent =
        LimitFriction(contact.tangent + Stopping(solid, other, touch, sliding), normal,
                      numbers.friction_static, numbers.friction_dynamic);
    Apply(placed, contact, touch, tangent - contact.tangent);
    contact.tangent = tangent;
  }
  return largest_change;
}

// Velocities contain the half step of gravity that the contact takes away in the next substep; what
// stops that has friction of its own, as that of particles has.
void PointContacts::Correct(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers) {
  for (Contact& contact : contacts_) {
    if (!(contact.normal > 0)) continue;
    PlacedCollider& solid = placed[contact.solid];
    PlacedCollider& other = placed[contact.other];
    const Touch touch = TouchAtEnd(placed, contact, true);
    const Vector3d& n = touch.n;
    const double change = contact.rebound - RelativeVelocity(solid, other, touch).dot(n);
    if (!(change > 0)) continue;
    const Vector3d kick = FallOf(solid, other) * seconds_ / 2 * numbers.gravity_m_per_s2;
    const double mobility = MobilityAlong(solid, other, touch, n);
    const double stops_kick = std::clamp(-kick.dot(n), 0.0, change) / mobility;
    const double normal = contact.normal + change / mobility - stops_kick;
    Apply(placed, contact, touch, change / mobility * n);
    if (numbers.friction_static == 0) continue;
    const auto rub = [&](const Vector3d& has, const Vector3d& sliding, double pressure) {
      const Vector3d wanted = has + Stopping(solid, other, touch, sliding);
      Apply(
          placed, contact, touch,
          LimitFriction(wanted, pressure, numbers.friction_static, numbers.friction_dynamic) - has);
    };
    rub(contact.tangent, Tangential(RelativeVelocity(solid, other, touch) - kick, n), normal);
    rub(Vector3d::Zero(), Tangential(RelativeVelocity(solid, other, touch), n), stops_kick);
  }
}

}  // namespace drape::bodies
