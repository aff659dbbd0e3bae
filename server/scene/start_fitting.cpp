#include "server/scene/start_fitting.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drape {
namespace {

using Eigen::Vector3d;

// Sweeps between two looks at the errors. They end when a look finds more than kStillUseful of the
// errors of the one before, or after kMaxVisits of links and particles: a second.
constexpr int kSweepsPerLook = 50;
constexpr double kStillUseful = 0.95;
constexpr double kMaxVisits = 5e7;
constexpr int kSharingSweeps = 400;
constexpr double kSharing = 0.1;
// Passes that bring particles out of colliders one of which is beside the other.
constexpr int kPassesOut = 20;

class Fitting {
 public:
  Fitting(const LengthDemands& demands, const AvoidedColliders& avoided,
          std::span<const Vector3d> positions_m)
      : demands_(demands),
        avoided_(avoided),
        w_(demands.inverse_masses_per_kg),
        x_(positions_m.begin(), positions_m.end()),
        order_(demands.constraints.size()) {
    // Back and forth in the order of the description, which leads through the cloth.
    for (uint32_t k = 0; k < order_.size(); ++k) order_[k] = k;
    std::ranges::sort(order_, {}, [&](uint32_t k) { return demands.constraint_sources[k]; });
  }

  bool IsTornOnTheWayOut() const {
    Fitting out(demands_, avoided_, x_);
    out.LeaveColliders();
    return std::ranges::any_of(demands_.constraints, [&](const DistanceConstraint& link) {
      return std::abs(out.StrainOf(link)) > kMaxStrainOnTheWayOut;
    });
  }

  FittedStart Fit() {
    const double visits =
        static_cast<double>(order_.size() + avoided_.colliders.size() * x_.size());
    double before = std::numeric_limits<double>::infinity();
    double now = RmsStrain();
    for (double spent = 0; now < kStillUseful * before && spent < kMaxVisits;) {
      for (int sweep = 0; sweep < kSweepsPerLook; ++sweep) {
        Sweep(sweep % 2 == 1, 1);
        LeaveCollidersOnce();
        Ask(avoided_.interruption);
      }
      spent += kSweepsPerLook * visits;
      before = now;
      now = RmsStrain();
    }
    // Full moves chase errors that cannot vanish around; ever smaller ones share them out.
    for (int sweep = 1; sweep <= kSharingSweeps; ++sweep) {
      Sweep(sweep % 2 == 1, 1.0 / (1 + kSharing * sweep));
      LeaveCollidersOnce();
      Ask(avoided_.interruption);
    }
    LeaveColliders();
    FittedStart fitted;
    for (const uint32_t k : order_) {
      const DistanceConstraint& link = demands_.constraints[k];
      const double change = std::abs(StrainOf(link));
      if (change <= kNotLetOut) {
        fitted.errors.max = std::max(fitted.errors.max, change);
        continue;
      }
      fitted.largest_change = std::max(fitted.largest_change, change);
      fitted.let_out.push_back({demands_.constraint_sources[k], Length(link)});
    }
    fitted.positions_m = std::move(x_);
    return fitted;
  }

 private:
  double Length(const DistanceConstraint& link) const { return (x_[link.j] - x_[link.i]).norm(); }
  double StrainOf(const DistanceConstraint& link) const {
    return Length(link) / link.rest_length_m - 1;
  }

  double RmsStrain() const {
    double sum_sq = 0;
    for (const DistanceConstraint& link : demands_.constraints) {
      sum_sq += StrainOf(link) * StrainOf(link);
    }
    return std::sqrt(sum_sq / static_cast<double>(std::max<size_t>(order_.size(), 1)));
  }

  // Each link moves by the share of what would give it its length.
  void Sweep(bool is_backward, double share) {
    for (size_t k = 0; k < order_.size(); ++k) {
      const uint32_t next = order_[is_backward ? order_.size() - 1 - k : k];
      const DistanceConstraint& link = demands_.constraints[next];
      const Vector3d d = x_[link.j] - x_[link.i];
      const double length_m = d.norm();
      if (length_m == 0) continue;
      const Vector3d way =
          share * (length_m - link.rest_length_m) / (length_m * (w_[link.i] + w_[link.j])) * d;
      x_[link.i] += w_[link.i] * way;
      x_[link.j] -= w_[link.j] * way;
    }
  }

  // Whether a particle was inside.
  bool LeaveCollidersOnce() {
    bool was_inside = false;
    for (const Collider& collider : avoided_.colliders) {
      for (size_t i = 0; i < x_.size(); ++i) {
        if (w_[i] == 0) continue;
        const SurfaceDistance surface = SurfaceOf(collider, x_[i]);
        const double depth_m = avoided_.thickness_m - surface.distance_m;
        if (depth_m <= 0) continue;
        was_inside = true;
        x_[i] += depth_m * surface.outward;
      }
    }
    return was_inside;
  }

  void LeaveColliders() {
    for (int pass = 0; pass < kPassesOut; ++pass) {
      if (!LeaveCollidersOnce()) return;
      Ask(avoided_.interruption);
    }
  }

  const LengthDemands& demands_;
  const AvoidedColliders& avoided_;
  const std::span<const double> w_;
  std::vector<Vector3d> x_;
  std::vector<uint32_t> order_;  // of the constraints
};

}  // namespace

FittedStart FitStart(const LengthDemands& demands, const AvoidedColliders& avoided,
                     std::span<const Vector3d> positions_m) {
  Fitting fitting(demands, avoided, positions_m);
  if (!fitting.IsTornOnTheWayOut()) return {};
  return fitting.Fit();
}

}  // namespace drape
