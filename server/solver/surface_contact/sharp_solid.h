// What Solid says of a box and of a cylinder, of one point or of four at once: Vector as in
// four_vectors.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/solver/solver_constants.h"
#include "server/solver/surface_contact/four_vectors.h"
#include "server/solver/surface_contact/solid.h"

namespace drape::surface_contact {

// From the nearest point of what has `offset` around it: d leads from there to x.
template <class Vector>
Gap<Vector> Along(const Vector& d, const Vector& otherwise, ScalarOf<BaseOf<Vector>> offset) {
  using Number = NumberOf<Vector>;
  using Real = ScalarOf<BaseOf<Vector>>;
  const Number distance = Length(d);
  const auto is_short = distance < static_cast<Real>(kMinDirectionLength_m);
  return {is_short ? OfAll<Number>(-offset) : Number(distance - offset),
          Select(is_short, otherwise, Vector(d / distance))};
}

// -1 to 1: on which side the farthest point is, halfway where n is level.
template <class Number>
Number SideOf(const Number& slope) {
  return ClampedBetween(Number(slope / OfAll<Number>(kLevelSlope)), OfAll<Number>(-1),
                        OfAll<Number>(1));
}

template <class Vector>
class AboveBox {
 public:
  using V = BaseOf<Vector>;
  using Real = ScalarOf<V>;
  using Number = NumberOf<Vector>;
  using Mask = MaskOf<Vector>;

  explicit AboveBox(const Solid<V>& solid)
      : point_(Same<Vector>(solid.point())), offset_(solid.offset()) {
    for (size_t k = 0; k < 3; ++k) {
      axes_[k] = Same<Vector>(solid.axis(k));
      extents_[k] = OfAll<Number>(solid.half_extents()[static_cast<int>(k)]);
    }
  }

  // Where a point is, and the face that it is above, or nearest to inside.
  struct Place {
    std::array<Number, 3> local, beyond;
    Mask is_y, is_z;
    Number face;  // 0 to 2, 3 more on its low side
  };
  Place PlaceOf(const Vector& x) const {
    Place place;
    const Vector d = x - point_;
    for (size_t k = 0; k < 3; ++k) {
      place.local[k] = Dot(axes_[k], d);
      place.beyond[k] = self_contact::Abs(place.local[k]) - extents_[k];
    }
    place.is_y = place.beyond[1] > place.beyond[0];
    const Number most = place.is_y ? place.beyond[1] : place.beyond[0];
    place.is_z = place.beyond[2] > most;
    place.is_y &= !place.is_z;
    const Number of_x_or_y = place.is_y ? OfAll<Number>(1) : Number{};
    const Number axis = place.is_z ? OfAll<Number>(2) : of_x_or_y;
    place.face = OfFace(place, place.local) < 0 ? Number(axis + OfAll<Number>(3)) : axis;
    return place;
  }

  Gap<Vector> At(const Place& place) const {
    const Number zero{};
    std::array<Number, 3> outside;
    Number count{};
    for (size_t k = 0; k < 3; ++k) {
      const Number& beyond = place.beyond[k];
      count += beyond > 0 ? OfAll<Number>(1) : zero;
      const Number way = place.local[k] < 0 ? Number(-beyond) : beyond;
      outside[k] = beyond > 0 ? way : zero;
    }
    const Vector axis = Select(place.is_z, axes_[2], Select(place.is_y, axes_[1], axes_[0]));
    const Vector normal = Select(place.face >= OfAll<Number>(3), Vector(-axis), axis);
    const Number gap = OfFace(place, place.beyond) - offset_;
    const auto is_above_face = count < OfAll<Number>(2);
    if (AreAllSet(is_above_face)) return {gap, normal};
    const Gap<Vector> beside = Along(FromLocal(outside), normal, offset_);
    return {is_above_face ? gap : beside.gap, Select(is_above_face, normal, beside.normal)};
  }

  // How far a point may move and still be above its face.
  Number RoomOf(const Place& place) const {
    Number room = self_contact::Abs(OfFace(place, place.local));  // inside, to the middle
    const Number beyond_face = OfFace(place, place.beyond);
    const std::array<Mask, 3> is_face{Mask(!(place.is_y | place.is_z)), place.is_y, place.is_z};
    for (size_t k = 0; k < 3; ++k) {
      // Inside, another face is as near where the differences are used up from both sides.
      const Number its =
          self_contact::Min(Number(-place.beyond[k]), Number((beyond_face - place.beyond[k]) / 2));
      room = is_face[k] ? room : self_contact::Min(room, its);
    }
    return room;
  }

  Vector Farthest(const Vector& n) const {
    std::array<Number, 3> local;
    for (size_t k = 0; k < 3; ++k) local[k] = extents_[k] * SideOf<Number>(Dot(axes_[k], n));
    return point_ + FromLocal(local);
  }

  // function(is_far, corner) of what AddNearlyFarthest may add.
  template <class Function>
  void ForNearlyFarthest(const Vector& n, const Function& function) const {
    const Number least = OfAll<Number>(-kNearlyLevel);
    std::array<Number, 3> slopes;
    for (size_t k = 0; k < 3; ++k) slopes[k] = Dot(axes_[k], n);
    for (uint32_t corner = 0; corner < 8; ++corner) {
      std::array<Number, 3> local;
      Mask is_far = Number{} == Number{};
      for (size_t k = 0; k < 3; ++k) {
        const bool is_high = (corner >> k & 1) != 0;
        is_far &= (is_high ? slopes[k] : Number(-slopes[k])) > least;
        local[k] = is_high ? extents_[k] : Number(-extents_[k]);
      }
      if (IsAnySet(is_far)) function(is_far, Vector(point_ + FromLocal(local)));
    }
  }

 private:
  // The number of the face that a point is above.
  static Number OfFace(const Place& place, const std::array<Number, 3>& numbers) {
    const Number of_x_or_y = place.is_y ? numbers[1] : numbers[0];
    return place.is_z ? numbers[2] : of_x_or_y;
  }
  Vector FromLocal(const std::array<Number, 3>& local) const {
    return axes_[0] * local[0] + axes_[1] * local[1] + axes_[2] * local[2];
  }

  Vector point_;
  std::array<Vector, 3> axes_;
  std::array<Number, 3> extents_;
  Real offset_;
};

// The same of a cylinder, whose ends are its faces.
template <class Vector>
class AboveCylinder {
 public:
  using V = BaseOf<Vector>;
  using Real = ScalarOf<V>;
  using Number = NumberOf<Vector>;

  explicit AboveCylinder(const Solid<V>& solid)
      : point_(Same<Vector>(solid.point())),
        axis_(Same<Vector>(solid.axis(0))),
        sideways_(Same<Vector>(solid.axis(1))),
        radius_(solid.radius()),
        half_length_(solid.half_length()),
        offset_(solid.offset()) {}

  struct Place {
    Vector across;
    Number along, from_axis, beyond_side, beyond_end;
    Number face;  // 1, or -1 at the other end
  };
  Place PlaceOf(const Vector& x) const {
    Place place;
    const Vector d = x - point_;
    place.along = Dot(d, axis_);
    place.across = d - axis_ * place.along;
    place.from_axis = Length(place.across);
    place.beyond_side = place.from_axis - radius_;
    place.beyond_end = self_contact::Abs(place.along) - half_length_;
    place.face = place.along < 0 ? OfAll<Number>(-1) : OfAll<Number>(1);
    return place;
  }

  Gap<Vector> At(const Place& place) const {
    const auto is_on_axis = place.from_axis < static_cast<Real>(kMinDirectionLength_m);
    const Vector sideways = Select(is_on_axis, sideways_, Vector(place.across / place.from_axis));
    const Vector endways = Select(place.along < 0, Vector(-axis_), axis_);
    const auto is_end = place.beyond_side < place.beyond_end;
    const Number gap = (is_end ? place.beyond_end : place.beyond_side) - offset_;
    const Vector normal = Select(is_end, endways, sideways);
    const MaskOf<Vector> is_beside = (place.beyond_side > 0) & (place.beyond_end > 0);
    if (!IsAnySet(is_beside)) return {gap, normal};
    const Gap<Vector> beside =
        Along(Vector(sideways * place.beyond_side + endways * place.beyond_end), sideways, offset_);
    return {is_beside ? beside.gap : gap, Select(is_beside, beside.normal, normal)};
  }

  Number RoomOf(const Place& place) const {
    const Number until_side = (place.beyond_end - place.beyond_side) / 2;
    return self_contact::Min(self_contact::Abs(place.along),
                             self_contact::Min(Number(-place.beyond_side), until_side));
  }

  Vector Farthest(const Vector& n) const {
    const Number along = Dot(axis_, n);
    const Vector across = n - axis_ * along;
    const Number size = self_contact::Max(Length(across), OfAll<Number>(kLevelSlope));
    return point_ + axis_ * Number(half_length_ * SideOf(along)) + across * Number(radius_ / size);
  }

  template <class Function>
  void ForNearlyFarthest(const Vector& n, const Function& function) const {
    const Number along = Dot(axis_, n);
    const MaskOf<Vector> is_far = self_contact::Abs(along) <= static_cast<Real>(kNearlyLevel);
    if (!IsAnySet(is_far)) return;
    const Vector across = n - axis_ * along;
    const Vector middle = point_ + across * Number(radius_ / Length(across));
    const Vector half = axis_ * OfAll<Number>(half_length_);
    function(is_far, Vector(middle - half));
    function(is_far, Vector(middle + half));
  }

 private:
  Vector point_, axis_, sideways_;
  Real radius_, half_length_, offset_;
};

// RoomAboveFace of Solid. Points above the same face have the same number of it.
template <class Vector, class Shape>
NumberOf<Vector> RoomAbove(const Shape& shape, std::span<const Vector> points) {
  using Number = NumberOf<Vector>;
  const auto first = shape.PlaceOf(points[0]);
  Number room = shape.RoomOf(first);
  MaskOf<Vector> is_one = Number{} == Number{};
  for (const Vector& point : points.subspan(1)) {
    const auto place = shape.PlaceOf(point);
    is_one &= place.face == first.face;
    room = self_contact::Min(room, shape.RoomOf(place));
  }
  return is_one ? self_contact::Max(room, Number{}) : Number{};
}

// function(shape) of a box or a cylinder; what it returns.
template <class Vector, class Function>
auto WithSharp(const Solid<BaseOf<Vector>>& solid, const Function& function) {
  return solid.kind() == ShapeKind::kBox ? function(AboveBox<Vector>(solid))
                                         : function(AboveCylinder<Vector>(solid));
}

}  // namespace drape::surface_contact
