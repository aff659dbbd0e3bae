#include "server/solver/surface_contact/four_parts.h"

#include <cmath>
#include <limits>

#include "server/solver/solver_constants.h"
#include "server/solver/surface_contact/lowest_point.h"

namespace drape::surface_contact {
namespace {

using self_contact::Abs;
using self_contact::BitsOf;
using self_contact::Max;
using self_contact::Min;

// A vector of four parts. V is a number of each of them.
template <class V>
struct Vectors {
  V x, y, z;

  Vectors operator+(const Vectors& other) const { return {x + other.x, y + other.y, z + other.z}; }
  Vectors operator-(const Vectors& other) const { return {x - other.x, y - other.y, z - other.z}; }
  Vectors operator-() const { return {-x, -y, -z}; }
  Vectors operator*(const V& factor) const { return {x * factor, y * factor, z * factor}; }
  Vectors operator/(const V& divisor) const { return {x / divisor, y / divisor, z / divisor}; }
};
template <class V>
using MaskOfFour = decltype(V{} < V{});

template <class V>
V OfFour(ScalarOf<V> value) {
  return V{value, value, value, value};
}
// The same vector of all parts.
template <class V>
Vectors<V> Same(const V& v) {
  return {OfFour<V>(v[0]), OfFour<V>(v[1]), OfFour<V>(v[2])};
}
template <class V>
Vectors<V> SideBySide(const std::array<V, kFour>& v) {
  const V xy_01 = __builtin_shufflevector(v[0], v[1], 0, 4, 1, 5);
  const V xy_23 = __builtin_shufflevector(v[2], v[3], 0, 4, 1, 5);
  const V z_01 = __builtin_shufflevector(v[0], v[1], 2, 6, 3, 7);
  const V z_23 = __builtin_shufflevector(v[2], v[3], 2, 6, 3, 7);
  return {__builtin_shufflevector(xy_01, xy_23, 0, 1, 4, 5),
          __builtin_shufflevector(xy_01, xy_23, 2, 3, 6, 7),
          __builtin_shufflevector(z_01, z_23, 0, 1, 4, 5)};
}

template <class V>
V Dot(const Vectors<V>& a, const Vectors<V>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class V>
V Length(const Vectors<V>& v) {
  const V squared = Dot(v, v);
  return V{std::sqrt(squared[0]), std::sqrt(squared[1]), std::sqrt(squared[2]),
           std::sqrt(squared[3])};
}
template <class V>
Vectors<V> Cross(const Vectors<V>& a, const Vectors<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
Vectors<V> Select(const MaskOfFour<V>& mask, const Vectors<V>& a, const Vectors<V>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

template <class V>
struct Gaps {
  V gap{};
  Vectors<V> normal{};
};

// As Along of solid.cpp.
template <class V>
Gaps<V> AlongOf(const Vectors<V>& d, const Vectors<V>& otherwise, ScalarOf<V> offset) {
  const V distance = Length(d);
  const auto is_short = distance < static_cast<ScalarOf<V>>(kMinDirectionLength_m);
  return {is_short ? OfFour<V>(-offset) : V(distance - offset),
          Select<V>(is_short, otherwise, d / distance)};
}

template <class V>
V Clamp(const V& v, const V& low, const V& high) {
  return Min(Max(v, low), high);
}
// As SideOf of solid.cpp.
template <class V>
V SidesOf(const V& slope) {
  return Clamp(V(slope / OfFour<V>(static_cast<ScalarOf<V>>(kLevelSlope))), OfFour<V>(-1),
               OfFour<V>(1));
}

// Which face of a solid some points are above, and for how long.
template <class V>
class RoomAbove {
 public:
  explicit RoomAbove(const V& face) : face_(face) {}
  // The next of the points. `face`: which one it is above.
  void Add(const V& face, const V& room) {
    is_one_ &= face == face_;
    room_ = Min(room_, room);
  }
  V room() const { return is_one_ ? Max(room_, V{}) : V{}; }

 private:
  V face_;
  MaskOfFour<V> is_one_ = V{} == V{};
  V room_ = OfFour<V>(std::numeric_limits<ScalarOf<V>>::max());
};

// What Solid says of four points at once; those of a box.
template <class V>
class FourAboveBox {
 public:
  using Real = ScalarOf<V>;

  explicit FourAboveBox(const Solid<V>& solid)
      : point_(Same(solid.point())), offset_(solid.offset()) {
    for (size_t k = 0; k < 3; ++k) {
      axes_[k] = Same(solid.axis(k));
      extents_[k] = OfFour<V>(solid.half_extents()[static_cast<int>(k)]);
    }
  }

  struct Place {
    std::array<V, 3> local, beyond;
    V face;  // 0 to 2, 3 more on its low side
    MaskOfFour<V> is_y, is_z;
  };
  Place PlaceOf(const Vectors<V>& x) const {
    Place place;
    const Vectors<V> d = x - point_;
    for (size_t k = 0; k < 3; ++k) {
      place.local[k] = Dot(axes_[k], d);
      place.beyond[k] = Abs(place.local[k]) - extents_[k];
    }
    place.is_y = place.beyond[1] > place.beyond[0];
    const V most = place.is_y ? place.beyond[1] : place.beyond[0];
    place.is_z = place.beyond[2] > most;
    place.is_y &= ~place.is_z;
    const V axis = place.is_z ? OfFour<V>(2) : place.is_y ? OfFour<V>(1) : V{};
    place.face = OfFace(place, place.local) < 0 ? axis + OfFour<V>(3) : axis;
    return place;
  }

  Gaps<V> At(const Place& place) const {
    const V zero{};
    std::array<V, 3> outside;
    V count{};
    for (size_t k = 0; k < 3; ++k) {
      const auto is_beyond = place.beyond[k] > 0;
      count += is_beyond ? OfFour<V>(1) : zero;
      const V way = place.local[k] < 0 ? -place.beyond[k] : place.beyond[k];
      outside[k] = is_beyond ? way : zero;
    }
    const Vectors<V> axis =
        Select<V>(place.is_z, axes_[2], Select<V>(place.is_y, axes_[1], axes_[0]));
    const Vectors<V> normal = Select<V>(place.face >= OfFour<V>(3), -axis, axis);
    const auto is_above_face = count < OfFour<V>(2);
    const Gaps<V> above_face{OfFace(place, place.beyond) - offset_, normal};
    if (BitsOf(is_above_face) == 0xF) return above_face;
    const Gaps<V> beside = AlongOf(FromLocal(outside), normal, offset_);
    return {is_above_face ? above_face.gap : beside.gap,
            Select<V>(is_above_face, above_face.normal, beside.normal)};
  }

  V RoomOf(const Place& place) const {
    V room = Abs(OfFace(place, place.local));
    const V beyond_face = OfFace(place, place.beyond);
    const MaskOfFour<V> is_x = ~(place.is_y | place.is_z);
    const std::array<MaskOfFour<V>, 3> is_face{is_x, place.is_y, place.is_z};
    for (size_t k = 0; k < 3; ++k) {
      const V its = Min(V(-place.beyond[k]), V((beyond_face - place.beyond[k]) / 2));
      room = is_face[k] ? room : Min(room, its);
    }
    return room;
  }

  Vectors<V> Farthest(const Vectors<V>& n) const {
    std::array<V, 3> local;
    for (size_t k = 0; k < 3; ++k) local[k] = extents_[k] * SidesOf<V>(Dot(axes_[k], n));
    return point_ + FromLocal(local);
  }

  // function(is_far, corner) of what AddNearlyFarthest may add.
  template <class Function>
  void ForNearlyFarthest(const Vectors<V>& n, const Function& function) const {
    const V level = OfFour<V>(static_cast<Real>(kNearlyLevel));
    std::array<V, 3> slopes;
    for (size_t k = 0; k < 3; ++k) slopes[k] = Dot(axes_[k], n);
    for (uint32_t corner = 0; corner < 8; ++corner) {
      std::array<V, 3> local;
      MaskOfFour<V> is_far = V{} == V{};
      for (size_t k = 0; k < 3; ++k) {
        const bool is_high = (corner >> k & 1) != 0;
        is_far &= (is_high ? slopes[k] : V(-slopes[k])) > -level;
        local[k] = is_high ? extents_[k] : V(-extents_[k]);
      }
      if (BitsOf(is_far) != 0) function(is_far, point_ + FromLocal(local));
    }
  }

 private:
  // The number of the face that a point is above.
  static V OfFace(const Place& place, const std::array<V, 3>& numbers) {
    return place.is_z ? numbers[2] : place.is_y ? numbers[1] : numbers[0];
  }
  Vectors<V> FromLocal(const std::array<V, 3>& local) const {
    return (axes_[0] * local[0] + axes_[1] * local[1]) + axes_[2] * local[2];
  }

  Vectors<V> point_;
  std::array<Vectors<V>, 3> axes_;
  std::array<V, 3> extents_;
  Real offset_;
};

// The same of a cylinder.
template <class V>
class FourAboveCylinder {
 public:
  using Real = ScalarOf<V>;

  explicit FourAboveCylinder(const Solid<V>& solid)
      : point_(Same(solid.point())),
        axis_(Same(solid.axis(0))),
        sideways_(Same(solid.axis(1))),
        radius_(solid.radius()),
        half_length_(solid.half_length()),
        offset_(solid.offset()) {}

  struct Place {
    V along, from_axis, beyond_side, beyond_end;
    V face;  // 1 at the end, -1 at the other one
    Vectors<V> across;
  };
  Place PlaceOf(const Vectors<V>& x) const {
    Place place;
    const Vectors<V> d = x - point_;
    place.along = Dot(d, axis_);
    place.across = d - axis_ * place.along;
    place.from_axis = Length(place.across);
    place.beyond_side = place.from_axis - radius_;
    place.beyond_end = Abs(place.along) - half_length_;
    place.face = place.along < 0 ? OfFour<V>(-1) : OfFour<V>(1);
    return place;
  }

  Gaps<V> At(const Place& place) const {
    const auto is_on_axis = place.from_axis < static_cast<Real>(kMinDirectionLength_m);
    const Vectors<V> sideways = Select<V>(is_on_axis, sideways_, place.across / place.from_axis);
    const Vectors<V> endways = Select<V>(place.along < 0, -axis_, axis_);
    const auto is_end = place.beyond_side < place.beyond_end;
    const Gaps<V> above_face{(is_end ? place.beyond_end : place.beyond_side) - offset_,
                             Select<V>(is_end, endways, sideways)};
    const auto is_beside = (place.beyond_side > 0) & (place.beyond_end > 0);
    if (BitsOf(is_beside) == 0) return above_face;
    const Gaps<V> beside =
        AlongOf(sideways * place.beyond_side + endways * place.beyond_end, sideways, offset_);
    return {is_beside ? beside.gap : above_face.gap,
            Select<V>(is_beside, beside.normal, above_face.normal)};
  }

  V RoomOf(const Place& place) const {
    const V until_side = (place.beyond_end - place.beyond_side) / 2;
    return Min(Abs(place.along), Min(V(-place.beyond_side), until_side));
  }

  Vectors<V> Farthest(const Vectors<V>& n) const {
    const V along = Dot(axis_, n);
    const Vectors<V> across = n - axis_ * along;
    const V size = Max(Length(across), OfFour<V>(static_cast<Real>(kLevelSlope)));
    return (point_ + axis_ * (half_length_ * SidesOf(along))) + across * (radius_ / size);
  }

  template <class Function>
  void ForNearlyFarthest(const Vectors<V>& n, const Function& function) const {
    const V along = Dot(axis_, n);
    const auto is_far = Abs(along) <= static_cast<Real>(kNearlyLevel);
    if (BitsOf(is_far) == 0) return;
    const Vectors<V> across = n - axis_ * along;
    const Vectors<V> middle = point_ + across * (radius_ / Length(across));
    const Vectors<V> half = axis_ * OfFour<V>(half_length_);
    function(is_far, middle - half);
    function(is_far, middle + half);
  }

 private:
  Vectors<V> point_, axis_, sideways_;
  Real radius_, half_length_, offset_;
};

template <class V, class Shape>
NothingLowest<V> OnEdges(const Shape& shape, const CornersOfFour<V, 2>& corners,
                         ScalarOf<V> expected) {
  using Real = ScalarOf<V>;
  Vectors<V> a = SideBySide(corners[0]), b = SideBySide(corners[1]);
  const Vectors<V> beyond = (b - a) * OfFour<V>(static_cast<Real>(kOverlap));
  a = a - beyond;
  b = b + beyond;
  const Vectors<V> d = b - a;
  const auto at_a = shape.PlaceOf(a), at_b = shape.PlaceOf(b);
  const Gaps<V> low = shape.At(at_a), high = shape.At(at_b);
  const V low_slope = Dot(low.normal, d), high_slope = Dot(high.normal, d);
  const V gap = Min(low.gap, high.gap);
  RoomAbove<V> above(at_a.face);
  above.Add(at_a.face, shape.RoomOf(at_a));
  above.Add(at_b.face, shape.RoomOf(at_b));
  const V room = low_slope == high_slope ? above.room() : V{};
  const V length_sq = Dot(d, d);
  auto may_be = ~(length_sq > 0) | ((low_slope < 0) & (high_slope > 0));
  // Whether NextOnEdge looks for the place where it leaves a face.
  const V level = OfFour<V>(static_cast<Real>(kNearlyLevel)) * Length(d);
  const auto leaves_at_low = (Abs(low_slope) < level) & (high_slope > low_slope + level);
  const auto leaves_at_high = (Abs(high_slope) < level) & (low_slope < high_slope - level);
  const auto is_asked = ~(gap > expected) & ~(room > 0);
  may_be |= is_asked & (leaves_at_low | leaves_at_high);
  return {~BitsOf(may_be) & 0xF, Max(room, gap)};
}

// Of triangles: the points of their planes that are nearest to others.
template <class V>
class FeetOn {
 public:
  explicit FeetOn(const std::array<Vectors<V>, 3>& corners)
      : corner_(corners[0]), e_(corners[1] - corners[0]), f_(corners[2] - corners[0]) {
    ee_ = Dot(e_, e_);
    ef_ = Dot(e_, f_);
    ff_ = Dot(f_, f_);
    determinant_ = ee_ * ff_ - ef_ * ef_;
  }
  // As AreInside of WeightsAt, for what is sharp.
  MaskOfFour<V> IsInside(const Vectors<V>& x) const {
    const V least = OfFour<V>(static_cast<ScalarOf<V>>(-kOverlap));
    const Vectors<V> d = x - corner_;
    const V de = Dot(d, e_), df = Dot(d, f_);
    const V v = (ff_ * de - ef_ * df) / determinant_, w = (ee_ * df - ef_ * de) / determinant_;
    return (OfFour<V>(1) - v - w > least) & (v > least) & (w > least);
  }

 private:
  Vectors<V> corner_, e_, f_;
  V ee_, ef_, ff_, determinant_;
};

template <class V, class Shape>
NothingLowest<V> OnTriangles(const Shape& shape, ScalarOf<V> offset,
                             const CornersOfFour<V, 3>& corners, ScalarOf<V> expected) {
  const std::array<Vectors<V>, 3> at{SideBySide(corners[0]), SideBySide(corners[1]),
                                     SideBySide(corners[2])};
  const auto first = shape.PlaceOf(at[0]);
  RoomAbove<V> above(first.face);
  above.Add(first.face, shape.RoomOf(first));
  for (size_t k = 1; k < 3; ++k) {
    const auto place = shape.PlaceOf(at[k]);
    above.Add(place.face, shape.RoomOf(place));
  }
  const V room = above.room();
  const Vectors<V> cross = Cross<V>(at[1] - at[0], at[2] - at[0]);
  const V twice_area = Length(cross);
  const auto has_area = twice_area > 0;
  const auto has_room = has_area & (room > 0);
  if (BitsOf(has_room) == 0xF) return {0xF, room};

  const Vectors<V> normal = cross / twice_area;
  const FeetOn<V> feet(at);
  const auto gap_along = [&](const Vectors<V>& n, const Vectors<V>& x) {
    return Dot<V>(n, at[0] - x) - offset;
  };
  const Vectors<V> farthest = shape.Farthest(normal), farthest_back = shape.Farthest(-normal);
  const V gap_ahead = gap_along(normal, farthest), gap_back = gap_along(-normal, farthest_back);
  const auto is_back = gap_back > gap_ahead;
  const V gap = is_back ? gap_back : gap_ahead;
  auto may_be = feet.IsInside(Select<V>(is_back, farthest_back, farthest));
  // Whether LowestCornerUnder finds something that is near enough.
  const auto is_asked = ~may_be & ~(gap > expected) & ~has_room;
  if (BitsOf(is_asked) != 0) {
    const Vectors<V> up = Select<V>(is_back, -normal, normal);
    shape.ForNearlyFarthest(up, [&](const auto& is_far, const Vectors<V>& corner) {
      may_be |= is_asked & is_far & feet.IsInside(corner) & (gap_along(up, corner) <= expected);
    });
  }
  may_be = (may_be & ~has_room) | ~has_area;
  return {~BitsOf(may_be) & 0xF, has_room ? room : Max(V{}, gap)};
}

}  // namespace

template <class V>
NothingLowest<V> NothingLowestOnEdges(const Solid<V>& solid, const CornersOfFour<V, 2>& corners,
                                      ScalarOf<V> expected) {
  if (solid.kind() == ShapeKind::kBox) return OnEdges(FourAboveBox<V>(solid), corners, expected);
  return OnEdges(FourAboveCylinder<V>(solid), corners, expected);
}

template <class V>
NothingLowest<V> NothingLowestOnTriangles(const Solid<V>& solid, const CornersOfFour<V, 3>& corners,
                                          ScalarOf<V> expected) {
  if (solid.kind() == ShapeKind::kBox) {
    return OnTriangles(FourAboveBox<V>(solid), solid.offset(), corners, expected);
  }
  return OnTriangles(FourAboveCylinder<V>(solid), solid.offset(), corners, expected);
}

#define DRAPE_FOUR(V)                                                                             \
  template NothingLowest<V> NothingLowestOnEdges(const Solid<V>&, const CornersOfFour<V, 2>&,     \
                                                 ScalarOf<V>);                                    \
  template NothingLowest<V> NothingLowestOnTriangles(const Solid<V>&, const CornersOfFour<V, 3>&, \
                                                     ScalarOf<V>)
DRAPE_FOUR(self_contact::Vector3f);
DRAPE_FOUR(self_contact::Vector3d);
#undef DRAPE_FOUR

}  // namespace drape::surface_contact
