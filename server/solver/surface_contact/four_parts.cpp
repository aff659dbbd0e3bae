#include "server/solver/surface_contact/four_parts.h"

#include <limits>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/solver_constants.h"
#include "server/solver/surface_contact/four_vectors.h"
#include "server/solver/surface_contact/lowest_point.h"

namespace drape::surface_contact {
namespace {

using self_contact::Abs;
using self_contact::BitsOf;
using self_contact::Max;
using self_contact::Min;

template <class V>
struct Gaps {
  V gap{};
  FourVectors<V> normal{};
};

// As Along of solid.cpp.
template <class V>
Gaps<V> AlongOf(const FourVectors<V>& d, const FourVectors<V>& otherwise, ScalarOf<V> offset) {
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
  Place PlaceOf(const FourVectors<V>& x) const {
    Place place;
    const FourVectors<V> d = x - point_;
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
    const FourVectors<V> axis =
        Select<V>(place.is_z, axes_[2], Select<V>(place.is_y, axes_[1], axes_[0]));
    const FourVectors<V> normal = Select<V>(place.face >= OfFour<V>(3), -axis, axis);
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

  FourVectors<V> Farthest(const FourVectors<V>& n) const {
    std::array<V, 3> local;
    for (size_t k = 0; k < 3; ++k) local[k] = extents_[k] * SidesOf<V>(Dot(axes_[k], n));
    return point_ + FromLocal(local);
  }

  // function(is_far, corner) of what AddNearlyFarthest may add.
  template <class Function>
  void ForNearlyFarthest(const FourVectors<V>& n, const Function& function) const {
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
  FourVectors<V> FromLocal(const std::array<V, 3>& local) const {
    return (axes_[0] * local[0] + axes_[1] * local[1]) + axes_[2] * local[2];
  }

  FourVectors<V> point_;
  std::array<FourVectors<V>, 3> axes_;
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
    FourVectors<V> across;
  };
  Place PlaceOf(const FourVectors<V>& x) const {
    Place place;
    const FourVectors<V> d = x - point_;
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
    const FourVectors<V> sideways =
        Select<V>(is_on_axis, sideways_, place.across / place.from_axis);
    const FourVectors<V> endways = Select<V>(place.along < 0, -axis_, axis_);
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

  FourVectors<V> Farthest(const FourVectors<V>& n) const {
    const V along = Dot(axis_, n);
    const FourVectors<V> across = n - axis_ * along;
    const V size = Max(Length(across), OfFour<V>(static_cast<Real>(kLevelSlope)));
    return (point_ + axis_ * (half_length_ * SidesOf(along))) + across * (radius_ / size);
  }

  template <class Function>
  void ForNearlyFarthest(const FourVectors<V>& n, const Function& function) const {
    const V along = Dot(axis_, n);
    const auto is_far = Abs(along) <= static_cast<Real>(kNearlyLevel);
    if (BitsOf(is_far) == 0) return;
    const FourVectors<V> across = n - axis_ * along;
    const FourVectors<V> middle = point_ + across * (radius_ / Length(across));
    const FourVectors<V> half = axis_ * OfFour<V>(half_length_);
    function(is_far, middle - half);
    function(is_far, middle + half);
  }

 private:
  FourVectors<V> point_, axis_, sideways_;
  Real radius_, half_length_, offset_;
};

// Tangent of lowest_point.cpp.
template <class V>
struct Tangents {
  V place{};
  Gaps<V> at{};
  V slope{};
};
template <class V>
Tangents<V> Select(const MaskOfFour<V>& mask, const Tangents<V>& a, const Tangents<V>& b) {
  return {mask ? a.place : b.place,
          {mask ? a.at.gap : b.at.gap, Select<V>(mask, a.at.normal, b.at.normal)},
          mask ? a.slope : b.slope};
}

// Where edges are lowest that fall inwards at both ends.
template <class V>
struct Dips {
  MaskOfFour<V> is_inside{};
  V place{};
  FourVectors<V> normal{};
  V gap{};

  void Set(const MaskOfFour<V>& mask, const MaskOfFour<V>& inside, const V& places,
           const FourVectors<V>& normals, const V& gaps) {
    is_inside |= mask & inside;
    place = mask ? places : place;
    normal = Select<V>(mask, normals, normal);
    gap = mask ? gaps : gap;
  }
};

// LowestByTangents of the edges that are set in `is_left`, without a tilt.
template <class V, class Shape>
Dips<V> DipsByTangents(const Shape& shape, ScalarOf<V> offset, const FourVectors<V>& a,
                       const FourVectors<V>& d, Tangents<V> low, Tangents<V> high,
                       ScalarOf<V> least, MaskOfFour<V> is_left) {
  using Real = ScalarOf<V>;
  const V zero{}, one = OfFour<V>(1);
  const V no_dip = Min(low.at.gap, high.at.gap) - least;
  const Real exactness = static_cast<Real>(kExactness) * least;
  Dips<V> dips;
  for (int k = 0;; ++k) {
    // Wedge of lowest_point.cpp.
    const V difference = low.slope - high.slope;
    const V crossing =
        (high.at.gap - low.at.gap + low.slope * low.place - high.slope * high.place) / difference;
    const V place = Clamp(crossing, low.place, high.place);
    const V height = low.at.gap + low.slope * (place - low.place);
    const V share = (zero - high.slope) / difference;
    const FourVectors<V> mean = low.at.normal * share + high.at.normal * (one - share);
    const V length = Length(mean);
    const auto is_across = length > static_cast<Real>(kLeastMean);
    const FourVectors<V> normal = mean / length;
    const V gap = (height + offset) / length - offset;

    const auto is_above = is_left & (height > no_dip);
    dips.Set(is_above, MaskOfFour<V>{}, place, normal, no_dip);
    is_left &= ~is_above;
    if (BitsOf(is_left) == 0) return dips;

    const V secant = low.place + low.slope / difference * (high.place - low.place);
    const V next_place = k % 2 == 0 ? place : secant;
    const Gaps<V> at = shape.At(shape.PlaceOf(a + d * next_place));
    const Tangents<V> next{next_place, at, Dot(at.normal, d)};

    const auto is_level = is_left & (next.slope == zero);
    dips.Set(is_level, is_level, next.place, next.at.normal, next.at.gap);
    is_left &= ~is_level;

    const V bound = is_across ? Max(height, gap) : height;
    auto is_over = (next.at.gap - bound <= exactness) |
                   ~((low.place < next.place) & (next.place < high.place));
    if (k == kMostTries) is_over = V{} == V{};
    is_over &= is_left;
    dips.Set(is_over, is_across, place, normal, is_across ? gap : height);
    is_left &= ~is_over;
    if (BitsOf(is_left) == 0) return dips;

    const auto is_low = next.slope < zero;
    low = Select<V>(is_low, next, low);
    high = Select<V>(is_low, high, next);
  }
}

// Those that are known, and of which something is inside.
template <class V>
FourLowest<V> KnownOf(uint32_t known, const V& free) {
  FourLowest<V> four{.known = known};
  for (size_t k = 0; k < kFour; ++k) {
    four.lowest[k].room = four.lowest[k].gap = free[static_cast<int>(k)];
  }
  return four;
}

template <class V, class Shape>
FourLowest<V> OnFourEdges(const Shape& shape, ScalarOf<V> offset,
                          const CornersOfFour<V, 2>& corners, ScalarOf<V> least,
                          ScalarOf<V> expected) {
  using Real = ScalarOf<V>;
  const V zero{};
  FourVectors<V> a = SideBySide(corners[0]), b = SideBySide(corners[1]);
  const FourVectors<V> beyond = (b - a) * OfFour<V>(static_cast<Real>(kOverlap));
  a = a - beyond;
  b = b + beyond;
  const FourVectors<V> d = b - a;
  // TangentAt has the other end by its way from the first one.
  const auto at_a = shape.PlaceOf(a);
  const Gaps<V> gap_a = shape.At(at_a), gap_b = shape.At(shape.PlaceOf(a + d));
  const Tangents<V> low{zero, gap_a, Dot(gap_a.normal, d)};
  const Tangents<V> high{OfFour<V>(1), gap_b, Dot(gap_b.normal, d)};
  V gap = Min(low.at.gap, high.at.gap);
  V room{};
  const auto is_level = low.slope == high.slope;
  if (BitsOf(is_level) != 0) {
    const auto at_b = shape.PlaceOf(b);
    RoomAbove<V> above(at_a.face);
    above.Add(at_a.face, shape.RoomOf(at_a));
    above.Add(at_b.face, shape.RoomOf(at_b));
    room = is_level ? above.room() : zero;
  }

  const auto has_length = Dot(d, d) > zero;
  const auto falls_inwards = has_length & (low.slope < zero) & (high.slope > zero);
  Dips<V> dips;
  if (BitsOf(falls_inwards) != 0) {
    dips = DipsByTangents<V>(shape, offset, a, d, low, high, least, falls_inwards);
    gap = falls_inwards ? dips.gap : gap;
  }
  // Whether NextOnEdge looks for the place where the others leave a face.
  const V level = OfFour<V>(static_cast<Real>(kNearlyLevel)) * Length(d);
  const auto leaves_at_low = (Abs(low.slope) < level) & (high.slope > low.slope + level);
  const auto leaves_at_high = (Abs(high.slope) < level) & (low.slope < high.slope - level);
  const auto is_asked = ~dips.is_inside & ~(gap > expected) & ~(room > zero);
  const auto is_known = has_length & ~(is_asked & (leaves_at_low | leaves_at_high));
  FourLowest<V> four = KnownOf<V>(BitsOf(is_known) & 0xF, Max(room, gap));
  const uint32_t inside = BitsOf(dips.is_inside);
  const std::array<V, kFour> normals = Apart(dips.normal);
  for (size_t k = 0; k < kFour; ++k) {
    if ((inside >> k & 1) == 0) continue;
    const auto lane = static_cast<int>(k);
    // As OnLongerEdge.
    const Real place = self_contact::Clamped(
        dips.place[lane] * static_cast<Real>(1 + 2 * kOverlap) - static_cast<Real>(kOverlap));
    four.lowest[k] = LowestPoint<V>{true, {1 - place, place, 0}, normals[k], gap[lane]};
  }
  return four;
}

// Of triangles: the points of their planes that are nearest to others.
template <class V>
class FeetOn {
 public:
  explicit FeetOn(const std::array<FourVectors<V>, 3>& corners)
      : corner_(corners[0]), e_(corners[1] - corners[0]), f_(corners[2] - corners[0]) {
    ee_ = Dot(e_, e_);
    ef_ = Dot(e_, f_);
    ff_ = Dot(f_, f_);
    determinant_ = ee_ * ff_ - ef_ * ef_;
  }
  // As AreInside of WeightsAt, for what is sharp.
  MaskOfFour<V> IsInside(const FourVectors<V>& x) const {
    const V least = OfFour<V>(static_cast<ScalarOf<V>>(-kOverlap));
    const FourVectors<V> d = x - corner_;
    const V de = Dot(d, e_), df = Dot(d, f_);
    const V v = (ff_ * de - ef_ * df) / determinant_, w = (ee_ * df - ef_ * de) / determinant_;
    return (OfFour<V>(1) - v - w > least) & (v > least) & (w > least);
  }

 private:
  FourVectors<V> corner_, e_, f_;
  V ee_, ef_, ff_, determinant_;
};

template <class V, class Shape>
FourLowest<V> OnFourTriangles(const Shape& shape, ScalarOf<V> offset,
                              const CornersOfFour<V, 3>& corners, ScalarOf<V> expected) {
  const std::array<FourVectors<V>, 3> at{SideBySide(corners[0]), SideBySide(corners[1]),
                                         SideBySide(corners[2])};
  const auto first = shape.PlaceOf(at[0]);
  RoomAbove<V> above(first.face);
  above.Add(first.face, shape.RoomOf(first));
  for (size_t k = 1; k < 3; ++k) {
    const auto place = shape.PlaceOf(at[k]);
    above.Add(place.face, shape.RoomOf(place));
  }
  const V room = above.room();
  const FourVectors<V> cross = Cross<V>(at[1] - at[0], at[2] - at[0]);
  const V twice_area = Length(cross);
  const auto has_area = twice_area > 0;
  const auto has_room = has_area & (room > 0);
  if (BitsOf(has_room) == 0xF) return KnownOf<V>(0xF, room);

  const FourVectors<V> normal = cross / twice_area;
  const FeetOn<V> feet(at);
  const auto gap_along = [&](const FourVectors<V>& n, const FourVectors<V>& x) {
    return Dot<V>(n, at[0] - x) - offset;
  };
  const FourVectors<V> farthest = shape.Farthest(normal), farthest_back = shape.Farthest(-normal);
  const V gap_ahead = gap_along(normal, farthest), gap_back = gap_along(-normal, farthest_back);
  const auto is_back = gap_back > gap_ahead;
  const V gap = is_back ? gap_back : gap_ahead;
  auto may_be = feet.IsInside(Select<V>(is_back, farthest_back, farthest));
  // Whether LowestCornerUnder finds something that is near enough.
  const auto is_asked = ~may_be & ~(gap > expected) & ~has_room;
  if (BitsOf(is_asked) != 0) {
    const FourVectors<V> up = Select<V>(is_back, -normal, normal);
    shape.ForNearlyFarthest(up, [&](const auto& is_far, const FourVectors<V>& corner) {
      may_be |= is_asked & is_far & feet.IsInside(corner) & (gap_along(up, corner) <= expected);
    });
  }
  may_be = (may_be & ~has_room) | ~has_area;
  return KnownOf<V>(~BitsOf(may_be) & 0xF, has_room ? room : Max(V{}, gap));
}

}  // namespace

template <class V>
FourLowest<V> LowestOnFourEdges(const Solid<V>& solid, const CornersOfFour<V, 2>& corners,
                                ScalarOf<V> least, ScalarOf<V> expected) {
  const ScalarOf<V> offset = solid.offset();
  if (solid.kind() == ShapeKind::kBox) {
    return OnFourEdges(FourAboveBox<V>(solid), offset, corners, least, expected);
  }
  return OnFourEdges(FourAboveCylinder<V>(solid), offset, corners, least, expected);
}

template <class V>
FourLowest<V> LowestOnFourTriangles(const Solid<V>& solid, const CornersOfFour<V, 3>& corners,
                                    ScalarOf<V> expected) {
  const ScalarOf<V> offset = solid.offset();
  if (solid.kind() == ShapeKind::kBox) {
    return OnFourTriangles(FourAboveBox<V>(solid), offset, corners, expected);
  }
  return OnFourTriangles(FourAboveCylinder<V>(solid), offset, corners, expected);
}

#define DRAPE_FOUR(V)                                                                       \
  template FourLowest<V> LowestOnFourEdges(const Solid<V>&, const CornersOfFour<V, 2>&,     \
                                           ScalarOf<V>, ScalarOf<V>);                       \
  template FourLowest<V> LowestOnFourTriangles(const Solid<V>&, const CornersOfFour<V, 3>&, \
                                               ScalarOf<V>)
DRAPE_FOUR(self_contact::Vector3f);
DRAPE_FOUR(self_contact::Vector3d);
#undef DRAPE_FOUR

}  // namespace drape::surface_contact
