#include "server/solver/bodies/convex_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace drape::bodies {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Below this sine directions are parallel [-]; as for flat rims.
constexpr double kParallelSine = 1e-9;
// A later axis counts only if it separates by more than this [-], of the sizes of both: among equal
// ones the first stays, whatever rounding says.
constexpr double kAxisAgreement = 1e-9;
// Outlines that meet within this [-], of their sizes, have the same border: what lies flush has the
// corners of one of both, not of both.
constexpr double kFlush = 1e-9;
// Two lines touch along both if they are parallel within this sine, and else where they cross [-].
// Larger: round things that cross sink in by half its square times the square of their length over
// the sum of their radii; smaller: logs on logs rock in a rounding.
constexpr double kLiesAlongSine = 1e-3;

double Cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// A corner of an outline seen along the normal. Edges have numbers, those of both outlines
// different ones; a corner is where two of them meet.
struct Corner {
  Vector2d seen;
  Vector3d place_m;
  int edge_before = 0;
  int edge_after = 0;
};
constexpr int kEdgesPerOutline = 64;
constexpr int kMostParts = 64;  // more than a solid has
static_assert(ConvexPolytope::kMostFaces < kMostParts &&
              ConvexPolytope::kMostCornersOfFace < kEdgesPerOutline);

// Where the way from a to b meets the line on which `over` is 0.
Corner Between(const Corner& a, const Corner& b, double over_a, double over_b) {
  const double share = over_a / (over_a - over_b);
  return {.seen = a.seen + share * (b.seen - a.seen),
          .place_m = a.place_m + share * (b.place_m - a.place_m)};
}

// What of the outline is not to the right of the line through `from` and `to`, which is edge `edge`
// (Sutherland and Hodgman 1974). Two corners are a line, not a face.
std::vector<Corner> Clipped(const std::vector<Corner>& outline, const Vector2d& from,
                            const Vector2d& to, int edge, double slack_m) {
  const auto over = [&](const Corner& corner) {
    return Cross((to - from).normalized(), corner.seen - from);
  };
  std::vector<Corner> kept;
  const size_t ways = outline.size() == 2 ? 1 : outline.size();
  for (size_t k = 0; k < ways; ++k) {
    const Corner& a = outline[k];
    const Corner& b = outline[(k + 1) % outline.size()];
    const double over_a = over(a), over_b = over(b);
    const bool is_a_in = over_a >= -slack_m, is_b_in = over_b >= -slack_m;
    if (is_a_in) kept.push_back(a);
    if (is_a_in != is_b_in) {
      Corner& met = kept.emplace_back(Between(a, b, over_a, over_b));
      met.edge_before = is_a_in ? a.edge_after : edge;
      met.edge_after = is_a_in ? edge : a.edge_after;
    }
    if (ways == 1 && is_b_in) kept.push_back(b);
  }
  return kept;
}

// Normal of a flat outline, of any length.
Vector3d NormalOf(std::span<const Corner> face) {
  const Vector3d& origin = face[0].place_m;
  const size_t third = face.size() / 3;
  return (face[third].place_m - origin).cross(face[2 * third].place_m - origin);
}

// The point of the face `along` n from a place.
Vector3d OnFace(std::span<const Corner> face, const Vector3d& place, const Vector3d& n) {
  const Vector3d normal = NormalOf(face);
  return place + normal.dot(face[0].place_m - place) / normal.dot(n) * n;
}

// The point of the line through both ends that is seen nearest to a place.
Vector3d OnLine(std::span<const Corner> line, const Vector2d& seen) {
  const Vector2d way = line[1].seen - line[0].seen;
  const double share = way.dot(seen - line[0].seen) / way.squaredNorm();
  return line[0].place_m + share * (line[1].place_m - line[0].place_m);
}

constexpr int kFarthest = -1;  // the name of what is farthest along the axis

struct Meeting {
  Vector3d on_first;
  Vector3d on_second;
  int name = 0;
};

// Of two lines: where they overlap if they are parallel, else where they cross.
std::vector<Meeting> MeetingsOfLines(std::vector<Corner> first, const std::vector<Corner>& second,
                                     double slack_m) {
  const Vector2d along = first[1].seen - first[0].seen;
  const Vector2d other = second[1].seen - second[0].seen;
  const double sine = Cross(along, other) / (along.norm() * other.norm());
  std::vector<Meeting> meetings;
  if (std::abs(sine) > kLiesAlongSine) {
    const Vector2d apart = second[0].seen - first[0].seen;
    const double share = Cross(apart, other) / Cross(along, other);
    const Vector2d seen = first[0].seen + std::clamp(share, 0.0, 1.0) * along;
    meetings.push_back({OnLine(first, seen), OnLine(second, seen)});
    return meetings;
  }
  // Between planes across the second one at both its ends.
  const Vector2d across(-other.y(), other.x());
  first = Clipped(first, second[0].seen, second[0].seen - across, kEdgesPerOutline, slack_m);
  if (first.size() == 2) {
    first = Clipped(first, second[1].seen, second[1].seen + across, kEdgesPerOutline + 1, slack_m);
  }
  for (const Corner& corner : first) {
    meetings.push_back({corner.place_m, OnLine(second, corner.seen),
                        kEdgesPerOutline * corner.edge_before + corner.edge_after});
  }
  return meetings;
}

// Of a line or face, the first, over a face.
std::vector<Meeting> MeetingsOverFace(std::vector<Corner> first, std::vector<Corner> face,
                                      const Vector3d& n, double slack_m) {
  const Vector2d middle = (face[0].seen + face[face.size() / 2].seen) / 2;
  if (Cross(face[0].seen - middle, face[1].seen - middle) < 0) std::ranges::reverse(face);
  for (size_t k = 0; k < face.size() && !first.empty(); ++k) {
    const int edge = kEdgesPerOutline + static_cast<int>(k);
    const Vector2d& to = face[(k + 1) % face.size()].seen;
    if (first.size() == 1) {
      if (Cross((to - face[k].seen).normalized(), first[0].seen - face[k].seen) < -slack_m)
        return {};
      continue;
    }
    first = Clipped(first, face[k].seen, to, edge, slack_m);
  }
  std::vector<Meeting> meetings;
  for (const Corner& corner : first) {
    meetings.push_back({corner.place_m, OnFace(face, corner.place_m, n),
                        2 * kEdgesPerOutline * corner.edge_before + corner.edge_after});
  }
  return meetings;
}

}  // namespace

Vector3d PairAxis::At(const RigidMotion& first, const RigidMotion& second) const {
  switch (kind) {
    case Kind::kOfFirst:
      return sign * (first.rotation * of_first);
    case Kind::kOfSecond:
      return sign * (second.rotation * of_second);
    case Kind::kAcross:
      break;
  }
  const Vector3d across = (first.rotation * of_first).cross(second.rotation * of_second);
  const double sine = across.norm();
  return sine > kParallelSine ? Vector3d(sign / sine * across) : Vector3d::Zero();
}

// The axis of a pair, from candidates in turn.
class ConvexPair::AxisSearch {
 public:
  AxisSearch(const ConvexPair& pair, const PlacedCollider& first, const PlacedCollider& second,
             double near_m, double slack_m)
      : start_(pair, first.start, second.start),
        end_(pair, first.end, second.end),
        near_m_(near_m),
        slack_m_(slack_m),
        size_m_(pair.first_.half_extents_m.sum() + pair.second_.half_extents_m.sum()) {}

  void Try(PairAxis axis) {
    const Vector3d n_at_start = axis.At(*start_.first_pose, *start_.second_pose);
    Vector3d n = axis.At(*end_.first_pose, *end_.second_pose);
    if (are_apart_ || n_at_start.isZero() || n.isZero()) return;
    double at_start = start_.SeparationAlong(n_at_start);
    const double reversed = start_.SeparationAlong(-n_at_start);
    if (reversed > at_start) {
      axis.sign = -1;
      n = -n;
      at_start = reversed;
    }
    const double at_end = end_.SeparationAlong(n);
    are_apart_ = at_end >= near_m_;
    // Shares of the substep until they meet count for more than how deep they are.
    double lateness = at_end / size_m_;
    if (at_start > slack_m_) lateness = 1 + at_start / (at_start + std::max(-at_end, 0.0));
    if (lateness <= lateness_ + kAxisAgreement) return;
    lateness_ = lateness;
    axis_ = axis;
    n_ = n;
    separation_m_ = at_end;
  }

  bool are_apart() const { return are_apart_; }
  const PairAxis& axis() const { return axis_; }
  // At the end of the substep.
  const Vector3d& n() const { return n_; }
  double separation_m() const { return separation_m_; }

 private:
  struct Placed {
    Placed(const ConvexPair& pair, const RigidMotion& first_at, const RigidMotion& second_at)
        : first_pose(&first_at),
          second_pose(&second_at),
          first(pair.first_.At(first_at)),
          second(pair.second_.At(second_at)) {}

    double SeparationAlong(const Vector3d& n) const {
      return n.dot(first.centre_m - second.centre_m) - first.ReachAlong(-n) - second.ReachAlong(n);
    }

    const RigidMotion* first_pose;
    const RigidMotion* second_pose;
    ConvexSolid first;
    ConvexSolid second;
  };

  Placed start_;
  Placed end_;
  double near_m_;
  double slack_m_;
  double size_m_;
  bool are_apart_ = false;
  double lateness_ = -std::numeric_limits<double>::infinity();
  PairAxis axis_;
  Vector3d n_ = Vector3d::Zero();
  double separation_m_ = 0;
};

// The corners of the polygon in which both overlap, and what is farthest.
size_t ConvexPair::most_spots() const {
  return first_.most_corners() + second_.most_corners() + 1;
}

// Of what is round: from points of one to the surface of the other, and across a rim and an edge.
std::vector<PairAxis> ConvexPair::RoundAxes(const PlacedCollider& first,
                                            const PlacedCollider& second,
                                            const BodyPoints& points_of_first,
                                            const BodyPoints& points_of_second) const {
  std::vector<PairAxis> axes;
  std::vector<Vector3d> turned;
  const auto add = [&](const PlacedCollider& solid, const PlacedCollider& other,
                       const BodyPoints& points, const ConvexSolid& edges, bool is_first) {
    const auto outward = [&](const Vector3d& described) -> Vector3d {
      return other.SurfaceAtEnd(solid.end.PlaceOf(described)).outward;
    };
    const auto downwards = [&](const Vector3d& described) -> Vector3d {
      return solid.end.rotation.conjugate() * -outward(described);
    };
    const std::vector<Vector3d>& places = points.PlacesTowards(downwards, turned);
    for (size_t k = 0; k < places.size(); ++k) {
      const Vector3d n = other.end.rotation.conjugate() * outward(places[k]);
      PairAxis& axis = axes.emplace_back();
      axis.kind = is_first ? PairAxis::Kind::kOfSecond : PairAxis::Kind::kOfFirst;
      (is_first ? axis.of_second : axis.of_first) = n;
      if (points.rims.empty() || k % kRimPoints != 0) continue;
      const Rim& rim = points.rims[k / kRimPoints];
      const Vector3d along_rim = rim.axis.cross(places[k] - rim.centre_m).normalized();
      for (size_t e = 0; e < edges.edge_count(); ++e) {
        PairAxis& across = axes.emplace_back();
        across.kind = PairAxis::Kind::kAcross;
        across.of_first = is_first ? along_rim : edges.EdgeDirection(e);
        across.of_second = is_first ? edges.EdgeDirection(e) : along_rim;
      }
    }
  };
  add(first, second, points_of_first, second_, true);
  add(second, first, points_of_second, first_, false);
  return axes;
}

void ConvexPair::FindSpots(const PlacedCollider& first, const PlacedCollider& second,
                           const BodyPoints& points_of_first, const BodyPoints& points_of_second,
                           double near_m, double slack_m) {
  spots_.clear();
  AxisSearch search(*this, first, second, near_m, slack_m);
  for (size_t f = 0; f < first_.face_count(); ++f) {
    search.Try({.kind = PairAxis::Kind::kOfFirst, .of_first = first_.FaceNormal(f)});
  }
  for (size_t f = 0; f < second_.face_count(); ++f) {
    search.Try({.kind = PairAxis::Kind::kOfSecond, .of_second = second_.FaceNormal(f)});
  }
  for (size_t a = 0; a < first_.edge_count(); ++a) {
    for (size_t b = 0; b < second_.edge_count() && !search.are_apart(); ++b) {
      search.Try({PairAxis::Kind::kAcross, first_.EdgeDirection(a), second_.EdgeDirection(b)});
    }
  }
  if (search.are_apart()) return;
  if (first_.is_round() || second_.is_round()) {
    for (const PairAxis& axis : RoundAxes(first, second, points_of_first, points_of_second)) {
      search.Try(axis);
    }
    if (search.are_apart()) return;
  }
  axis_ = search.axis();
  AddSpots(first.end, second.end, search.n(), search.separation_m());
}

void ConvexPair::AddSpots(const RigidMotion& first, const RigidMotion& second, const Vector3d& n,
                          double separation_m) {
  const Outline outlines[] = {first_.At(first).OutlineTowards(-n),
                              second_.At(second).OutlineTowards(n)};
  parts_ = kMostParts * outlines[0].part + outlines[1].part;
  const double slack_m = kFlush * (first_.half_extents_m.sum() + second_.half_extents_m.sum() +
                                   first_.disc_m + second_.disc_m);
  const Vector3d u = n.unitOrthogonal(), v = n.cross(u);
  const auto seen = [&](const Outline& outline) {
    std::vector<Corner> corners;
    const int count = static_cast<int>(outline.corners_m.size());
    for (int k = 0; k < count; ++k) {
      const Vector3d& place = outline.corners_m[static_cast<size_t>(k)];
      corners.push_back({Vector2d(u.dot(place), v.dot(place)), place, (k + count - 1) % count, k});
    }
    return corners;
  };
  const std::vector<Corner> ours = seen(outlines[0]), theirs = seen(outlines[1]);
  std::vector<Meeting> meetings;
  if (ours.size() == 2 && theirs.size() == 2) {
    meetings = MeetingsOfLines(ours, theirs, slack_m);
  } else if (theirs.size() > 2) {
    meetings = MeetingsOverFace(ours, theirs, n, slack_m);
  } else if (ours.size() > 2) {
    meetings = MeetingsOverFace(theirs, ours, n, slack_m);
    for (Meeting& meeting : meetings) std::swap(meeting.on_first, meeting.on_second);
  }
  const double rounds_m = outlines[0].round_m + outlines[1].round_m;
  double least_gap_m = std::numeric_limits<double>::infinity();
  for (const Meeting& meeting : meetings) {
    least_gap_m = std::min(least_gap_m, n.dot(meeting.on_first - meeting.on_second) - rounds_m);
  }
  if (least_gap_m > separation_m + slack_m) {
    // Points, or outlines of which the nearest parts miss each other, as those of an edge and of
    // the round end of a capsule: what is farthest along the axis touches.
    const bool is_ours = ours.size() <= theirs.size();
    const Vector3d out = is_ours ? Vector3d(-n) : n;
    const auto farthest = std::ranges::max_element(
        is_ours ? ours : theirs, {}, [&](const Corner& corner) { return out.dot(corner.place_m); });
    const Vector3d opposite = farthest->place_m + (separation_m + rounds_m) * out;
    meetings.push_back({is_ours ? farthest->place_m : opposite,
                        is_ours ? opposite : farthest->place_m, kFarthest});
  }
  for (const Meeting& meeting : meetings) {
    spots_.push_back({.on_first = first.DescribedAt(meeting.on_first),
                      .on_second = second.DescribedAt(meeting.on_second),
                      .round_of_first_m = outlines[0].round_m,
                      .round_of_second_m = outlines[1].round_m,
                      .name = meeting.name});
  }
}

SurfaceDistance ConvexPair::GapAt(const PairSpot& spot, const RigidMotion& first,
                                  const RigidMotion& second) const {
  const Vector3d n = axis_.At(first, second);
  const double between = n.dot(first.PlaceOf(spot.on_first) - second.PlaceOf(spot.on_second));
  return {between - spot.round_of_first_m - spot.round_of_second_m, n};
}

}  // namespace drape::bodies
