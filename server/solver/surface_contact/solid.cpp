#include "server/solver/surface_contact/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/scene/distance_map.h"
#include "server/solver/solver_constants.h"

namespace drape::surface_contact {
namespace {

using self_contact::Dot;
using self_contact::FromVector;
using self_contact::Length;
using self_contact::ToVector;

// From the nearest point of what has `offset` around it: d leads from there to x.
template <class V>
Gap<V> Along(const V& d, const V& otherwise, ScalarOf<V> offset) {
  const ScalarOf<V> distance = Length(d);
  if (distance < static_cast<ScalarOf<V>>(kMinDirectionLength_m)) return {-offset, otherwise};
  return {distance - offset, d / distance};
}

// -1 to 1: on which side the farthest point is, halfway where n is level.
template <class Real>
Real SideOf(Real slope) {
  return std::clamp(slope / static_cast<Real>(kLevelSlope), Real{-1}, Real{1});
}

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
V Solid<V>::Local(const V& x) const {
  const V d = x - point_;
  return V{Dot(axes_[0], d), Dot(axes_[1], d), Dot(axes_[2], d), 0};
}

template <class V>
V Solid<V>::FromLocal(const V& local) const {
  return local[0] * axes_[0] + local[1] * axes_[1] + local[2] * axes_[2];
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
    case ShapeKind::kBox: {
      const V local = Local(x);
      const V beyond = self_contact::Abs(local) - vector_;
      int beyond_count = 0, face = 0;
      V outside{};
      for (int k = 0; k < 3; ++k) {
        beyond_count += beyond[k] > 0;
        if (beyond[k] > beyond[face]) face = k;
        outside[k] = beyond[k] > 0 ? (local[k] < 0 ? -beyond[k] : beyond[k]) : Real{0};
      }
      const V normal =
          local[face] < 0 ? V(-axes_[static_cast<size_t>(face)]) : axes_[static_cast<size_t>(face)];
      if (beyond_count < 2) return {beyond[face] - offset_, normal};
      return Along(FromLocal(outside), normal, offset_);
    }
    case ShapeKind::kCylinder: {
      const V d = x - point_;
      const V& axis = axes_[0];
      const Real along = Dot(d, axis);
      const V across = d - along * axis;
      const Real from_axis = Length(across);
      const V sideways =
          from_axis < static_cast<Real>(kMinDirectionLength_m) ? axes_[1] : V(across / from_axis);
      const V endways = along < 0 ? V(-axis) : axis;
      const Real beyond_side = from_axis - radius_;
      const Real beyond_end = std::abs(along) - half_length_;
      if (beyond_side > 0 && beyond_end > 0) {
        return Along(V(beyond_side * sideways + beyond_end * endways), sideways, offset_);
      }
      if (beyond_side < beyond_end) return {beyond_end - offset_, endways};
      return {beyond_side - offset_, sideways};
    }
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
    case ShapeKind::kBox: {
      V local{};
      for (int k = 0; k < 3; ++k) {
        local[k] = vector_[k] * SideOf(Dot(axes_[static_cast<size_t>(k)], n));
      }
      return point_ + FromLocal(local);
    }
    case ShapeKind::kCylinder: {
      const V& axis = axes_[0];
      const Real along = Dot(axis, n);
      const V across = n - along * axis;
      const Real size = std::max(Length(across), static_cast<Real>(kLevelSlope));
      return point_ + half_length_ * SideOf(along) * axis + (radius_ / size) * across;
    }
    case ShapeKind::kSphere:
    case ShapeKind::kPlane:
    case ShapeKind::kDistanceMap:
      break;
  }
  return point_;
}

template <class V>
void Solid<V>::AddNearlyFarthest(const V& n, std::vector<V>& points) const {
  const auto level = static_cast<Real>(kNearlyLevel);
  if (kind_ == ShapeKind::kBox) {
    for (uint32_t corner = 0; corner < 8; ++corner) {
      V local{};
      bool is_far = true;
      for (int k = 0; k < 3; ++k) {
        const Real side = (corner >> k & 1) != 0 ? 1 : -1;
        is_far &= side * Dot(axes_[static_cast<size_t>(k)], n) > -level;
        local[k] = side * vector_[k];
      }
      if (is_far) points.push_back(point_ + FromLocal(local));
    }
  } else if (kind_ == ShapeKind::kCapsule) {
    const Real length = Length(vector_);
    if (!(std::abs(Dot(vector_, n)) < level * length)) return;
    points.push_back(point_);
    points.push_back(point_ + vector_);
  } else if (kind_ == ShapeKind::kCylinder) {
    const V& axis = axes_[0];
    const Real along = Dot(axis, n);
    if (std::abs(along) > level) return;
    const V across = n - along * axis;
    const V middle = point_ + (radius_ / Length(across)) * across;
    points.push_back(middle - half_length_ * axis);
    points.push_back(middle + half_length_ * axis);
  }
}

template <class V>
ScalarOf<V> Solid<V>::RoomAboveFace(std::span<const V> points) const {
  if (kind_ == ShapeKind::kBox) {
    int face = -1;
    bool is_low = false;
    Real room = std::numeric_limits<Real>::max();
    for (const V& x : points) {
      const V local = Local(x);
      const V beyond = self_contact::Abs(local) - vector_;
      int its = 0;
      for (int k = 1; k < 3; ++k) {
        if (beyond[k] > beyond[its]) its = k;
      }
      if (face >= 0 && (its != face || (local[its] < 0) != is_low)) return 0;
      face = its;
      is_low = local[its] < 0;
      room = std::min(room, std::abs(local[its]));  // inside, to the middle
      for (int k = 0; k < 3; ++k) {
        if (k == face) continue;
        // Inside, another face is as near where the differences are used up from both sides.
        room = std::min({room, -beyond[k], (beyond[face] - beyond[k]) / 2});
      }
    }
    return std::max(room, Real{0});
  }
  if (kind_ == ShapeKind::kCylinder) {
    Real room = std::numeric_limits<Real>::max();
    Real side = 0;
    for (const V& x : points) {
      const V d = x - point_;
      const Real along = Dot(d, axes_[0]);
      const Real beyond_side = Length(V(d - along * axes_[0])) - radius_;
      const Real beyond_end = std::abs(along) - half_length_;
      const Real its = along < 0 ? -1 : 1;
      if (side * its < 0) return 0;
      side = its;
      room = std::min({room, std::abs(along), -beyond_side, (beyond_end - beyond_side) / 2});
    }
    return std::max(room, Real{0});
  }
  return 0;
}

template class Solid<self_contact::Vector3f>;
template class Solid<self_contact::Vector3d>;

}  // namespace drape::surface_contact
