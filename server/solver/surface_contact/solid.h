// The distance from a collider, in single or double precision: what `LowestOnEdge` asks of it.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/colliders.h"
#include "server/solver/surface_contact/four_vectors.h"

namespace drape::surface_contact {

// Distance from the surface less the thickness, negative inside [m], and the outward unit normal.
// Of four points: V is FourVectors.
template <class V>
struct Gap {
  NumberOf<V> gap{};
  V normal{};
};

// A collider as described, with the cloth's thickness around it. Its distance is convex unless it
// is a distance map. Constant.
template <class V>
class Solid {
 public:
  using Real = ScalarOf<V>;

  // Not of a plane.
  Solid(const Collider& collider, double thickness_m);

  ShapeKind kind() const { return kind_; }
  bool is_convex() const { return kind_ != ShapeKind::kDistanceMap; }
  // It has edges: sharp_solid.h.
  bool is_sharp() const { return kind_ == ShapeKind::kBox || kind_ == ShapeKind::kCylinder; }
  // HalfWidth_m, of a map half a cell: what moves farther within a substep may pass [m].
  Real half_width() const { return half_width_; }
  // Of a distance map [m].
  Real cell() const { return cell_; }
  // A radius that is around all of it: the thickness, of round shapes with their own [m].
  Real offset() const { return offset_; }

  Gap<V> At(const V& x) const;
  // Of a convex one: the point of what has `offset` around it that is farthest along the unit
  // vector n. Where a whole edge or face is, to kLevelSlope, it changes smoothly with n.
  V Farthest(const V& n) const;
  // Appends the corners of a box, or the ends of a cylinder's side or a capsule's axis, that are as
  // far along it as the farthest point, but for the slope kNearlyLevel of what leads there; other
  // shapes have none.
  void AddNearlyFarthest(const V& n, std::vector<V>& points) const;
  // How far points above the same face, both where they are, may move and still be above it [m];
  // 0: they are not.
  Real RoomAboveFace(std::span<const V> points) const;

  // The ends of a capsule's segment, and the centre of a sphere twice.
  const V& segment_begin() const { return point_; }
  const V& segment() const { return vector_; }
  // The middle of a box or cylinder, the axes of a box, with half of its extents along them [m], or
  // the axis of a cylinder and what is sideways on it.
  const V& point() const { return point_; }
  const V& axis(size_t k) const { return axes_[k]; }
  const V& half_extents() const { return vector_; }
  Real radius() const { return radius_; }
  Real half_length() const { return half_length_; }

 private:
  ShapeKind kind_;
  V point_{};
  V vector_{};
  std::array<V, 3> axes_{};
  Real offset_ = 0;
  Real radius_ = 0;       // of a cylinder
  Real half_length_ = 0;  // of a cylinder
  Real half_width_;
  Real cell_ = 0;
  std::shared_ptr<const DistanceMap> map_;
  RigidTransform pose_;  // of the map
};

// Faces and edges that are this level lie flat on each other [-]. Larger: supports are taken where
// there are none, by that share of their lengths; smaller: rounding throws the point of support
// from one end to the other.
inline constexpr double kLevelSlope = 1e-3;

// Corners at the other end of an edge or face that is this level count beside the farthest one [-].
// Larger: more that are beneath a triangle are tried; smaller: what tilts farther within some
// substeps comes down on a corner that nothing has foreseen.
inline constexpr double kNearlyLevel = 0.1;

extern template class Solid<self_contact::Vector3f>;
extern template class Solid<self_contact::Vector3d>;

}  // namespace drape::surface_contact
