#include "server/solver/surface_contact/placed_solid.h"

namespace drape::surface_contact {

using self_contact::Cross;
using self_contact::Dot;
using self_contact::Length;
using self_contact::ToVector;

template <class V>
PlacedSolid<V>::PlacedSolid(const Collider& collider, const RigidMotion* motion, double thickness_m,
                            size_t place)
    : solid_(collider, thickness_m),
      place_(place),
      moves_(motion != nullptr),
      motion_(moves_ ? *motion : RigidMotion::AtRest(CentreOf(collider))),
      pivot_(ToVector<V>(motion_.pivot_m)),
      velocity_(ToVector<V>(motion_.velocity_m_per_s)),
      angular_velocity_(ToVector<V>(motion_.angular_velocity_rad_per_s)),
      speed_(Length(velocity_)),
      turn_(Length(angular_velocity_)) {
  start_ = end_ = PoseOf(motion_);
}

template <class V>
typename PlacedSolid<V>::Pose PlacedSolid<V>::PoseOf(const RigidMotion& motion) {
  const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
  return {
      ToVector<V>(motion.position_m),
      {ToVector<V>(rotation.col(0)), ToVector<V>(rotation.col(1)), ToVector<V>(rotation.col(2))}};
}

template <class V>
void PlacedSolid<V>::Place(double begin_s, double end_s) {
  if (!moves_) return;
  duration_ = static_cast<Real>(end_s - begin_s);
  start_ = PoseOf(motion_.After(begin_s));
  end_ = PoseOf(motion_.After(end_s));
  const ChordFactors chord = motion_.ChordOver(end_s - begin_s);
  chord_sine_ = static_cast<Real>(chord.sine);
  chord_cosine_ = static_cast<Real>(chord.cosine_s);
}

template <class V>
V PlacedSolid<V>::Described(const Pose& pose, const V& x) const {
  const V d = x - pose.position;
  return pivot_ + V{Dot(pose.columns[0], d), Dot(pose.columns[1], d), Dot(pose.columns[2], d), 0};
}

template <class V>
V PlacedSolid<V>::Turned(const Pose& pose, const V& n) {
  return n[0] * pose.columns[0] + n[1] * pose.columns[1] + n[2] * pose.columns[2];
}

template <class V>
V PlacedSolid<V>::VelocityAt(const Pose& pose, const V& place) const {
  if (!moves_) return V{};
  return velocity_ + Cross(angular_velocity_, V(place - pose.position));
}

template <class V>
V PlacedSolid<V>::WayOf(const V& place) const {
  if (!moves_) return V{};
  const V tangent = Cross(angular_velocity_, V(place - start_.position));
  return duration_ *
         (velocity_ + chord_sine_ * tangent + chord_cosine_ * Cross(angular_velocity_, tangent));
}

template <class V>
ScalarOf<V> PlacedSolid<V>::FarthestFromPivot(const V& low, const V& high) const {
  const V below = self_contact::Abs(V(low - start_.position));
  const V above = self_contact::Abs(V(high - start_.position));
  return Length(self_contact::Max(below, above));
}

template class PlacedSolid<self_contact::Vector3f>;
template class PlacedSolid<self_contact::Vector3d>;

}  // namespace drape::surface_contact
