#include "server/solver/cpu_reference/reference_colliders.h"

namespace drape {

using Eigen::Vector3d;

void ReferenceColliders::Place(double begin_s, double end_s) {
  duration_s_ = end_s - begin_s;
  at_start_.clear();
  at_end_.clear();
  for (const RigidMotion& motion : parameters_.collider_motions) {
    at_start_.push_back(motion.After(begin_s));
    at_end_.push_back(motion.After(end_s));
  }
}

ReferenceContact ReferenceColliders::AtStart(size_t c, const Vector3d& p) const {
  const Collider& collider = parameters_.colliders[c];
  if (at_start_.empty()) return ContactAt(collider, parameters_.thickness_m, p);
  return ContactAt(collider, StartOf(c), parameters_.thickness_m, p);
}

ReferenceContact ReferenceColliders::AtEnd(size_t c, const Vector3d& q) const {
  const Collider& collider = parameters_.colliders[c];
  if (at_end_.empty()) return ContactAt(collider, parameters_.thickness_m, q);
  return ContactAt(collider, EndOf(c), parameters_.thickness_m, q);
}

Vector3d ReferenceColliders::PivotAtEnd(size_t c) const {
  return at_end_.empty() ? CentreOf(parameters_.colliders[c]) : EndOf(c).position_m;
}

Vector3d ReferenceColliders::VelocityAtStart(size_t c, const Vector3d& place) const {
  return at_start_.empty() ? Vector3d::Zero() : StartOf(c).VelocityAt(place);
}

Vector3d ReferenceColliders::VelocityAtEnd(size_t c, const Vector3d& place) const {
  return at_end_.empty() ? Vector3d::Zero() : EndOf(c).VelocityAt(place);
}

Vector3d ReferenceColliders::MeanVelocity(size_t c, const Vector3d& place) const {
  if (at_start_.empty()) return Vector3d::Zero();
  return (EndOf(c).PlaceOf(StartOf(c).DescribedAt(place)) - place) / duration_s_;
}

}  // namespace drape
