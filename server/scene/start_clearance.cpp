#include "server/scene/start_clearance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>

namespace drape {
namespace {

using Eigen::Vector3d;

// Steps on the way out of colliders along a line, each as long as the particle is deep, and this
// share of the mean length more, so that they end.
constexpr uint32_t kMaxSteps = 1000;
constexpr double kLeastStep = 1e-3;
// The way down is taken if it needs less than this share of the motion up.
constexpr double kMuchLess = 0.9;

bool IsPin(const LengthDemands& demands, uint32_t i) {
  return demands.inverse_masses_per_kg[i] == 0;
}

// The relation of a particle to one collider.
struct Place {
  bool is_inside = false;
  Vector3d outside_m;  // by the nearest way; unchanged for particles outside and for pins
};

// The places of all particles; empty: none of them is inside.
std::vector<Place> FindPlaces(const LengthDemands& demands, const Collider& collider,
                              double thickness_m, std::span<const Vector3d> positions_m) {
  std::vector<Place> places;
  for (uint32_t i = 0; i < positions_m.size(); ++i) {
    const SurfaceDistance surface = SurfaceOf(collider, positions_m[i]);
    const double gap_m = surface.distance_m - thickness_m;
    if (gap_m >= 0) continue;
    if (places.empty()) {
      for (const Vector3d& p : positions_m) places.push_back({false, p});
    }
    places[i].is_inside = true;
    if (!IsPin(demands, i)) places[i].outside_m -= gap_m * surface.outward;
  }
  return places;
}

bool IsCaught(const DistanceConstraint& link, const std::vector<Place>& places,
              std::span<const Vector3d> positions_m) {
  const double described_m = (positions_m[link.j] - positions_m[link.i]).norm();
  const double pushed_m = (places[link.j].outside_m - places[link.i].outside_m).norm();
  return pushed_m > kCaughtRatio * std::max(link.rest_length_m, described_m);
}

// Sets of particles, each identified by its least index.
class Sets {
 public:
  explicit Sets(size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), uint32_t{0});
  }
  uint32_t Find(uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void Unite(uint32_t i, uint32_t j) {
    i = Find(i);
    j = Find(j);
    parents_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parents_;
};

// Particles inside one collider that hang together by links, some of which are caught.
struct Knot {
  std::vector<uint32_t> particles;
  std::vector<Vector3d> outside_m;  // [particles] by the nearest way
};

struct Knots {
  std::vector<Knot> knots;
  bool has_pinned_link = false;  // with a link that is caught
};

void FindKnotsOf(const LengthDemands& demands, const std::vector<Place>& places,
                 std::span<const Vector3d> positions_m, Knots& found) {
  Sets sets(places.size());
  std::vector<uint32_t> caught;
  for (const DistanceConstraint& link : demands.constraints) {
    if (!places[link.i].is_inside || !places[link.j].is_inside) continue;
    sets.Unite(link.i, link.j);
    if (link.kind == ConstraintKind::kAtLeast || !IsCaught(link, places, positions_m)) continue;
    caught.push_back(link.i);
    found.has_pinned_link |= IsPin(demands, link.i) || IsPin(demands, link.j);
  }
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> knot_of(places.size(), kNone);  // by the least particle
  for (const uint32_t i : caught) knot_of[sets.Find(i)] = 0;
  for (uint32_t i = 0; i < places.size(); ++i) {
    uint32_t& knot = knot_of[sets.Find(i)];
    if (knot == kNone) continue;
    if (sets.Find(i) == i) {
      knot = static_cast<uint32_t>(found.knots.size());
      found.knots.emplace_back();
    }
    found.knots[knot].particles.push_back(i);
    found.knots[knot].outside_m.push_back(places[i].outside_m);
  }
}

Knots FindKnots(const LengthDemands& demands, const AvoidedColliders& avoided,
                std::span<const Vector3d> positions_m) {
  Knots found;
  for (const Collider& collider : avoided.colliders) {
    const auto places = FindPlaces(demands, collider, avoided.thickness_m, positions_m);
    if (!places.empty()) FindKnotsOf(demands, places, positions_m, found);
  }
  return found;
}

// The direction in which a knot and the particles that it is linked to extend the least, upwards.
Vector3d NormalOf(const LengthDemands& demands, const Knot& knot,
                  std::span<const Vector3d> positions_m, const Vector3d& up) {
  std::vector<bool> is_in_knot(positions_m.size()), is_near(positions_m.size());
  for (const uint32_t i : knot.particles) is_in_knot[i] = is_near[i] = true;
  for (const DistanceConstraint& link : demands.constraints) {
    if (is_in_knot[link.i] || is_in_knot[link.j]) is_near[link.i] = is_near[link.j] = true;
  }
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (size_t i = 0; i < positions_m.size(); ++i) {
    if (!is_near[i]) continue;
    sum += positions_m[i];
    ++count;
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < positions_m.size(); ++i) {
    if (!is_near[i]) continue;
    const Vector3d d = positions_m[i] - sum / count;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const Vector3d normal = axes.eigenvectors().col(0);
  return normal.dot(up) < 0 ? Vector3d(-normal) : normal;
}

// False: there is no way out in this direction.
bool LeadOut(const AvoidedColliders& avoided, const Vector3d& direction, double least_step_m,
             Vector3d& p) {
  for (uint32_t step = 0; step < kMaxSteps && p.allFinite(); ++step) {
    double depth_m = 0;
    for (const Collider& collider : avoided.colliders) {
      depth_m = std::max(depth_m, avoided.thickness_m - SurfaceOf(collider, p).distance_m);
    }
    if (depth_m == 0) return true;
    p += (depth_m + least_step_m) * direction;
  }
  return false;
}

// Positions of all particles with the knots out of the colliders, lengths not yet restored.
struct WayOut {
  std::vector<Vector3d> positions_m;  // empty: there is none
  double motion_kg_m2 = 0;
};

class WayFinder {
 public:
  WayFinder(const LengthDemands& demands, const AvoidedColliders& avoided, const Vector3d& up,
            std::span<const Vector3d> positions_m)
      : demands_(demands), avoided_(avoided), up_(up), start_m_(positions_m) {}

  // In the order of the attempts.
  std::vector<WayOut> Find(const std::vector<Knot>& knots) const {
    WayOut above = ToOneSide(knots, 1), below = ToOneSide(knots, -1);
    const bool is_below_much_less =
        above.positions_m.empty() ||
        (!below.positions_m.empty() && below.motion_kg_m2 < kMuchLess * above.motion_kg_m2);
    if (is_below_much_less) std::swap(above, below);
    std::vector<WayOut> ways = {std::move(above), std::move(below), ByNearestWays(knots)};
    std::erase_if(ways, [](const WayOut& way) { return way.positions_m.empty(); });
    return ways;
  }

 private:
  WayOut ToOneSide(const std::vector<Knot>& knots, double side) const {
    WayOut way{.positions_m = {start_m_.begin(), start_m_.end()}};
    for (const Knot& knot : knots) {
      const Vector3d direction = side * NormalOf(demands_, knot, start_m_, up_);
      for (const uint32_t i : knot.particles) {
        if (IsPin(demands_, i)) continue;
        Vector3d& p = way.positions_m[i];
        if (!LeadOut(avoided_, direction, kLeastStep * demands_.length_scale_m, p)) return {};
        way.motion_kg_m2 += (p - start_m_[i]).squaredNorm() / demands_.inverse_masses_per_kg[i];
      }
    }
    return way;
  }

  WayOut ByNearestWays(const std::vector<Knot>& knots) const {
    WayOut way{.positions_m = {start_m_.begin(), start_m_.end()}};
    for (const Knot& knot : knots) {
      for (size_t k = 0; k < knot.particles.size(); ++k) {
        way.positions_m[knot.particles[k]] = knot.outside_m[k];
      }
    }
    return way;
  }

  const LengthDemands& demands_;
  const AvoidedColliders& avoided_;
  const Vector3d& up_;
  std::span<const Vector3d> start_m_;
};

// Compliant links get no longer than described.
std::vector<DistanceConstraint> LinksToKeep(const LengthDemands& demands,
                                            std::span<const Vector3d> positions_m) {
  std::vector<DistanceConstraint> links(demands.constraints.begin(), demands.constraints.end());
  for (DistanceConstraint& link : links) {
    if (link.compliance_m_per_n == 0 || link.kind == ConstraintKind::kAtLeast) continue;
    const double described_m = (positions_m[link.j] - positions_m[link.i]).norm();
    link = {link.i, link.j, std::max(link.rest_length_m, described_m), 0, ConstraintKind::kAtMost};
  }
  return links;
}

}  // namespace

ClearStart ClearOfColliders(const LengthDemands& demands, const AvoidedColliders& avoided,
                            const Vector3d& up, std::span<const Vector3d> positions_m) {
  const Knots described = FindKnots(demands, avoided, positions_m);
  if (described.knots.empty()) return {};
  if (described.has_pinned_link) return {.clearance = StartClearance::kCaught};
  const std::vector<DistanceConstraint> links = LinksToKeep(demands, positions_m);
  LengthDemands kept = demands;
  kept.constraints = links;
  for (WayOut& way : WayFinder(demands, avoided, up, positions_m).Find(described.knots)) {
    Ask(avoided.interruption);
    const LengthErrors errors = RestoreLengths(kept, way.positions_m, avoided);
    if (NeedsRestoring(errors)) continue;
    if (!FindKnots(demands, avoided, way.positions_m).knots.empty()) continue;
    return {StartClearance::kCleared, std::move(way.positions_m), errors};
  }
  return {.clearance = StartClearance::kCaught};
}

}  // namespace drape
