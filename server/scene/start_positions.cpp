#include "server/scene/start_positions.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "server/scene/avoided_colliders.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Sweeps that bring links from anywhere to about their lengths; the remaining errors are smooth and
// small enough for Newton's method.
constexpr uint32_t kSweeps = 1000;
// Sweeps spread the strain at the rims of colliders slowly over large cloths. If they leave more
// than kSweptError (RMS), rounds follow: kHeavySweeps that keep kMomentum of the last motion, then
// kPlainSweeps for the wrinkles that these leave. Rounds end when one leaves more than kUseful of
// the errors before it.
constexpr double kSweptError = 3e-3;
constexpr uint32_t kHeavySweeps = 200;
constexpr double kMomentum = 0.95;
constexpr uint32_t kPlainSweeps = 50;
constexpr double kUseful = 0.8;
constexpr uint32_t kMaxNewtonSteps = 60;
// Newton steps without a smaller error in between, after which no more are tried.
constexpr uint32_t kPatience = 8;
// Tolerance of conjugate gradients: a Newton step needs its direction only roughly.
constexpr double kLinearTolerance = 1e-4;
constexpr int kMaxLinearIterations = 2000;
// Newton's matrices take some hundred bytes per row; for more rows there are only sweeps.
constexpr size_t kMaxNewtonRows = size_t{1} << 18;
// From the described positions first, then from disordered ones.
constexpr uint32_t kAttempts = 5;
// Amount of disorder, in mean lengths: enough to leave a line, too little to turn links over.
constexpr double kDisorder = 0.1;
// Visits of constraints, all together: a few seconds.
constexpr double kMaxWork = 2e8;
// Below this length [m] a difference has no direction.
constexpr double kShortest_m = 1e-12;

constexpr uint32_t kNoParticle = ~0u;

// One scalar demand at some positions: `error_m` is the excess distance of j from i along n. For a
// collider: how far i has to move along n.
struct Row {
  uint32_t i = 0;
  uint32_t j = kNoParticle;
  Vector3d n;
  double error_m = 0;
  double length_m = 1;  // the error is relative to it
};

double WhatIsForbidden(ConstraintKind kind, double error_m) {
  if (kind == ConstraintKind::kAtMost) return std::max(error_m, 0.0);
  if (kind == ConstraintKind::kAtLeast) return std::min(error_m, 0.0);
  return error_m;
}

class Restoration {
 public:
  Restoration(const LengthDemands& demands, const AvoidedColliders& avoided,
              std::vector<Vector3d> positions_m)
      : demands_(demands),
        avoided_(avoided),
        w_(demands.inverse_masses_per_kg),
        x_(std::move(positions_m)) {
    for (const DistanceConstraint& constraint : demands.constraints) {
      if (constraint.compliance_m_per_n == 0) order_.push_back(OrderOf(constraint));
    }
  }

  LengthErrors Run(std::vector<Vector3d>& positions_m) {
    std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
      return demands_.constraint_sources[a] < demands_.constraint_sources[b];
    });
    best_ = x_;
    best_errors_ = Errors();
    PullToPins();
    for (uint32_t attempt = 0; attempt < kAttempts; ++attempt) {
      if (attempt > 0) Disorder();
      // Back and forth in the order of the description, which leads through the cloth.
      SweepPlainly(kSweeps);
      if (!avoided_.colliders.empty()) SpreadErrors();
      KeepIfBetter();
      Correct();
      if (best_errors_.max <= kRestoredError || work_ >= kMaxWork) break;
      x_ = best_;
    }
    positions_m = best_;
    return best_errors_;
  }

  LengthErrors Errors() const {
    LengthErrors errors;
    double sum_sq = 0, count = 0;
    EachRow([&](const Row& row) {
      const double error = std::abs(row.error_m) / row.length_m;
      errors.max = std::max(errors.max, error);
      sum_sq += error * error;
      if (row.j != kNoParticle) ++count;
    });
    errors.rms = count > 0 ? std::sqrt(sum_sq / count) : 0;
    return errors;
  }

 private:
  uint32_t OrderOf(const DistanceConstraint& constraint) const {
    return static_cast<uint32_t>(&constraint - demands_.constraints.data());
  }

  Row RowOf(const DistanceConstraint& constraint) const {
    const Vector3d d = x_[constraint.j] - x_[constraint.i];
    const double length_m = d.norm();
    return {.i = constraint.i,
            .j = constraint.j,
            .n = length_m < kShortest_m ? Vector3d::UnitX() : Vector3d(d / length_m),
            .error_m = WhatIsForbidden(constraint.kind, length_m - constraint.rest_length_m),
            .length_m = constraint.rest_length_m};
  }

  template <class Visit>
  void EachJointRow(const Visit& visit) const {
    for (const PointJoint& joint : demands_.joints) {
      if (joint.compliance_m_per_n > 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        visit(Row{.i = joint.i,
                  .j = joint.j,
                  .n = Vector3d::Unit(axis),
                  .error_m = (x_[joint.j] - x_[joint.i])[axis],
                  .length_m = demands_.length_scale_m});
      }
    }
  }

  // Visits the particles that are inside.
  template <class Visit>
  void EachColliderRow(const Visit& visit) const {
    for (const Collider& collider : avoided_.colliders) {
      for (uint32_t i = 0; i < x_.size(); ++i) {
        if (w_[i] == 0) continue;
        const SurfaceDistance surface = SurfaceOf(collider, x_[i]);
        const double gap_m = surface.distance_m - avoided_.thickness_m;
        if (gap_m >= 0) continue;
        visit(Row{
            .i = i, .n = surface.outward, .error_m = -gap_m, .length_m = demands_.length_scale_m});
      }
    }
  }

  template <class Visit>
  void EachRow(const Visit& visit) const {
    for (const uint32_t k : order_) visit(RowOf(demands_.constraints[k]));
    EachJointRow(visit);
    EachColliderRow(visit);
  }

  void PullToPins() {
    for (uint32_t i = 0; i + 1 < demands_.tethers.offsets.size(); ++i) {
      for (uint32_t k = demands_.tethers.offsets[i]; k < demands_.tethers.offsets[i + 1]; ++k) {
        const Tether& tether = demands_.tethers.tethers[k];
        const Vector3d d = x_[i] - x_[tether.pin];
        if (d.norm() > tether.length_m) {
          x_[i] = x_[tether.pin] + d * (tether.length_m / d.norm());
        }
      }
    }
  }

  void Disorder() {
    const double most_m = kDisorder * demands_.length_scale_m;
    // Not a distribution of the library, whose numbers depend on its version.
    const auto any = [&] {
      return most_m * (2 * static_cast<double>(random_()) / std::mt19937::max() - 1);
    };
    for (size_t i = 0; i < x_.size(); ++i) {
      if (w_[i] == 0) continue;
      for (int axis = 0; axis < 3; ++axis) x_[i][axis] += any();
    }
  }

  void Meet(const Row& row) {
    if (row.j == kNoParticle) {
      x_[row.i] += row.error_m * row.n;
      return;
    }
    const Vector3d way = row.error_m / (w_[row.i] + w_[row.j]) * row.n;
    x_[row.i] += w_[row.i] * way;
    x_[row.j] -= w_[row.j] * way;
  }

  // Every demand in turn, at the positions after the one before.
  void Sweep(bool is_backward) {
    Ask(avoided_.interruption);
    for (size_t k = 0; k < order_.size(); ++k) {
      const uint32_t next = order_[is_backward ? order_.size() - 1 - k : k];
      Meet(RowOf(demands_.constraints[next]));
    }
    EachJointRow([&](const Row& row) { Meet(row); });
    EachColliderRow([&](const Row& row) { Meet(row); });
    work_ += static_cast<double>(order_.size() + 3 * demands_.joints.size() +
                                 avoided_.colliders.size() * x_.size());
  }

  void SweepPlainly(uint32_t sweeps) {
    for (uint32_t s = 0; s < sweeps && work_ < kMaxWork; ++s) Sweep(s % 2 == 1);
  }

  void SpreadErrors() {
    double before = std::numeric_limits<double>::infinity();
    double now = Errors().rms;
    while (work_ < kMaxWork && now > kSweptError && now < kUseful * before) {
      std::vector<Vector3d> last = x_;
      for (uint32_t s = 0; s < kHeavySweeps && work_ < kMaxWork; ++s) {
        const std::vector<Vector3d> here = x_;
        for (size_t i = 0; i < x_.size(); ++i) x_[i] += kMomentum * (x_[i] - last[i]);
        last = here;
        Sweep(s % 2 == 1);
      }
      SweepPlainly(kPlainSweeps);
      before = now;
      now = Errors().rms;
    }
  }

  bool KeepIfBetter() {
    const LengthErrors errors = Errors();
    if (!(errors.rms < best_errors_.rms)) return false;
    best_errors_ = errors;
    best_ = x_;
    return true;
  }

  // Newton's method until the errors are within the tolerance or get no smaller.
  void Correct() {
    if (order_.size() + 3 * demands_.joints.size() > kMaxNewtonRows) return;
    uint32_t failures = 0;
    for (uint32_t step = 0; step < kMaxNewtonSteps && work_ < kMaxWork; ++step) {
      Ask(avoided_.interruption);
      if (best_errors_.max <= kRestoredError || failures > kPatience) return;
      const std::vector<Vector3d> motion = LeastMotion();
      double longest_m = 0;
      for (const Vector3d& way : motion) longest_m = std::max(longest_m, way.norm());
      if (!std::isfinite(longest_m)) return;
      // Over more than a link's length the linearised demands mean nothing.
      const double share =
          longest_m > demands_.length_scale_m ? demands_.length_scale_m / longest_m : 1;
      for (size_t i = 0; i < x_.size(); ++i) x_[i] += share * motion[i];
      failures = KeepIfBetter() ? 0 : failures + 1;
    }
  }

  // -W J^T (J W J^T)^-1 C, of the linearised demands.
  std::vector<Vector3d> LeastMotion() {
    std::vector<Row> rows;
    EachRow([&](const Row& row) {
      if (row.error_m != 0) rows.push_back(row);
    });
    using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    Matrix weighted(static_cast<Eigen::Index>(rows.size()),
                    3 * static_cast<Eigen::Index>(x_.size()));  // J W^1/2
    weighted.reserve(Eigen::VectorXi::Constant(weighted.rows(), 6));
    Eigen::VectorXd errors(weighted.rows());
    for (Eigen::Index k = 0; k < weighted.rows(); ++k) {
      const Row& row = rows[static_cast<size_t>(k)];
      errors[k] = row.error_m;
      for (int axis = 0; axis < 3; ++axis) {
        weighted.insert(k, 3 * Eigen::Index{row.i} + axis) = -std::sqrt(w_[row.i]) * row.n[axis];
        if (row.j == kNoParticle) continue;
        weighted.insert(k, 3 * Eigen::Index{row.j} + axis) = std::sqrt(w_[row.j]) * row.n[axis];
      }
    }
    const Matrix matrix = weighted * weighted.transpose();
    Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(kLinearTolerance);
    solver.setMaxIterations(kMaxLinearIterations);
    const Eigen::VectorXd impulses = solver.compute(matrix).solve(errors);
    work_ += static_cast<double>((solver.iterations() + 10) * weighted.rows());

    std::vector<Vector3d> motion(x_.size(), Vector3d::Zero());
    for (Eigen::Index k = 0; k < weighted.rows(); ++k) {
      const Row& row = rows[static_cast<size_t>(k)];
      motion[row.i] += w_[row.i] * impulses[k] * row.n;
      if (row.j != kNoParticle) motion[row.j] -= w_[row.j] * impulses[k] * row.n;
    }
    return motion;
  }

  const LengthDemands& demands_;
  const AvoidedColliders& avoided_;
  std::span<const double> w_;
  std::vector<Vector3d> x_;
  std::vector<uint32_t> order_;  // of the rigid constraints
  std::vector<Vector3d> best_;
  LengthErrors best_errors_;
  double work_ = 0;
  std::mt19937 random_{1};
};

}  // namespace

LengthErrors FindLengthErrors(const LengthDemands& demands, std::span<const Vector3d> positions_m) {
  return Restoration(demands, {}, {positions_m.begin(), positions_m.end()}).Errors();
}

bool NeedsRestoring(const LengthErrors& errors) {
  return errors.max > kMaxStartError || errors.rms > kMaxStartRmsError;
}

LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Vector3d>& positions_m,
                            Interruption* interruption) {
  return RestoreLengths(demands, positions_m, {{}, 0, interruption});
}

LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Vector3d>& positions_m,
                            const AvoidedColliders& avoided) {
  return Restoration(demands, avoided, positions_m).Run(positions_m);
}

}  // namespace drape
