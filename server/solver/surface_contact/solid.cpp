#include "server/solver/surface_contact/solid.h"

#include <algorithm>
#include <cmath>

#include "server/scene/distance_map.h"
#include "server/solver/surface_contact/sharp_solid.h"

namespace drape::surface_contact {
namespace {

using self_contact::Dot;
using self_contact::FromVector;
using self_contact::Length;
using self_contact::ToVector;

template <class V>
V SideNormal(const V& axis) {
  return ToVector<V>(NormalOnSegment(FromVector(axis)));
}

}  // namespace

template <class V>
Solid<V>::Solid(const Collider& collider, double thickness_m)
    : kind_(collider.kind()), half_width_(static_cast<Real>(HalfWidth_m(collider))) {
  const ColliderNumbers numbers = NumbersOf(collider);
  point_ = ToVector<V>(numbers.point_m);
  vector_ = ToVector<V>(numbers.vector);
  for (int k = 0; k < 3; ++k) {
    axes_[static_cast<size_t>(k)] = ToVector<V>(numbers.axes.col(k));
  }
  offset_ = static_cast<Real>(thickness_m);
  if (kind_ == ShapeKind::kSphere || kind_ == ShapeKind::kCapsule) {
    offset_ += static_cast<Real>(numbers.radius_m);
  } else if (kind_ == ShapeKind::kCylinder) {
    radius_ = vector_[0];
    half_length_ = vector_[1];
  } else if (kind_ == ShapeKind::kDistanceMap) {
    map_ = MapOf(collider);
    pose_ = collider.pose;
    cell_ = static_cast<Real>(map_->cell_m());
    half_width_ = cell_ / 2;
  }
}

template <class V>
Gap<V> Solid<V>::At(const V& x) const {
  switch (kind_) {
    case ShapeKind::kCapsule: {
      const V d = x - point_;
      const Real length_sq = Dot(vector_, vector_);
      const Real along =
          length_sq > 0 ? std::clamp(Dot(d, vector_) / length_sq, Real{0}, Real{1}) : Real{0};
      return Along(V(d - along * vector_), axes_[0], offset_);
    }
    case ShapeKind::kBox:
    case ShapeKind::kCylinder:
      return WithSharp<V>(*this, [&](const auto& shape) { return shape.At(shape.PlaceOf(x)); });
    case ShapeKind::kDistanceMap: {
      const auto surface =
          map_->SurfaceAt(pose_.rotation.conjugate() * (FromVector(x) - pose_.position_m));
      return {static_cast<Real>(surface.distance_m) - offset_,
              ToVector<V>(pose_.rotation * surface.outward)};
    }
    case ShapeKind::kSphere:
    case ShapeKind::kPlane:
      break;
  }
  return Along(V(x - point_), V{0, 1, 0, 0}, offset_);
}

template <class V>
V Solid<V>::Farthest(const V& n) const {
  switch (kind_) {
    case ShapeKind::kCapsule: {
      const Real length = Length(vector_);
      if (!(length > 0)) return point_;
      return point_ + (1 + SideOf(Dot(vector_, n) / length)) / 2 * vector_;
    }
    case ShapeKind::kBox:
    case ShapeKind::kCylinder:
      return WithSharp<V>(*this, [&](const auto& shape) { return shape.Farthest(n); });
    case ShapeKind::kSphere:
    case ShapeKind::kPlane:
    case ShapeKind::kDistanceMap:
      break;
  }
  return point_;
}

template <class V>
void Solid<V>::AddNearlyFarthest(const V& n, std::vector<V>& points) const {
  if (is_sharp()) {
    WithSharp<V>(*this, [&](const auto& shape) {
      shape.ForNearlyFarthest(n, [&](bool is_far, const V& point) {
        if (is_far) points.push_back(point);
      });
    });
  } else if (kind_ == ShapeKind::kCapsule) {
    const Real length = Length(vector_);
    if (!(std::abs(Dot(vector_, n)) < static_cast<Real>(kNearlyLevel) * length)) return;
    points.push_back(point_);
    points.push_back(point_ + vector_);
  }
}

template <class V>
ScalarOf<V> Solid<V>::RoomAboveFace(std::span<const V> points) const {
  if (!is_sharp()) return 0;
  return WithSharp<V>(*this, [&](const auto& shape) { return RoomAbove(shape, points); });
}

template class Solid<self_contact::Vector3f>;
template class Solid<self_contact::Vector3d>;

}  // namespace drape::surface_contact
