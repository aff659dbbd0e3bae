#include "server/solver/bodies/placed_collider.h"

namespace drape::bodies {

using Eigen::Vector3d;

void PlacedCollider::Begin(double begin_s, double seconds, const Vector3d& gravity_m_per_s2) {
  if (!body) {
    start = motion.After(begin_s);
    end = motion.After(begin_s + seconds);
    return;
  }
  start = body->motion();
  body->Begin(seconds, gravity_m_per_s2);
  end = body->AtEnd();
  is_under_way_ = true;
}

void PlacedCollider::End() {
  if (!body) return;
  body->End();
  end = body->motion();
  is_under_way_ = false;
}

SurfaceDistance PlacedCollider::SurfaceAt(const RigidMotion& pose, const Vector3d& q) const {
  SurfaceDistance surface = SurfaceOf(*collider, pose.DescribedAt(q));
  surface.outward = pose.rotation * surface.outward;
  return surface;
}

double PlacedCollider::MobilityAlong(const Vector3d& n, const Vector3d& arm_m) const {
  return body ? body->MobilityAlong(n, arm_m) : 0;
}

void PlacedCollider::Change(const Vector3d& impulse, const Vector3d& moment) {
  if (!body) return;
  body->Change(impulse, moment);
  end = is_under_way_ ? body->AtEnd() : body->motion();
}

void PlacedCollider::Shift(const Vector3d& way_m, const Vector3d& turn_rad) {
  if (!body) return;
  body->Shift(way_m, turn_rad);
  end = body->AtEnd();
}

}  // namespace drape::bodies
