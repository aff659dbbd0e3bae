#include "tests/bench/accuracy/direct_solver.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "server/core/check.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// A factorisation that needs more corrections than this is renewed at the next step; one that needs
// kMaxCorrections does not fit the step at all.
constexpr uint32_t kManyCorrections = 6;
constexpr uint32_t kMaxCorrections = 60;

}  // namespace

// The multipliers of one step: x' = x~ - W J(x)^T lambda with C(x') = 0, where C_k = (|d_k|^2 -
// l_k^2) / (2 l_k) and row k of J is d_k / l_k at the start of the step. Corrected with A = J W J^T
// of some earlier step: the solution is exact, it only takes more corrections.
class DirectSolver::Impulses {
 public:
  explicit Impulses(std::shared_ptr<const SceneModel> model) : model_(std::move(model)) {
    DRAPE_CHECK(!model_->has_compliance() && model_->spring_count() == 0,
                "the direct solver has neither compliance nor springs");
    FindPairs();
    lambda_.setZero(model_->constraint_count());
    error_ = lambda_;
    factors_.analyzePattern(matrix_);
  }

  bool IsPinned(size_t particle) const { return model_->inverse_masses_per_kg()[particle] == 0; }

  // Moves `positions`, predicted from `start`, onto the constraints.
  void Project(const std::vector<Vector3d>& start, std::vector<Vector3d>& positions) {
    SetDirections(start);
    if (!is_factored_) Factor();
    Apply(lambda_, positions);  // those of the last step: nearly right
    uint32_t corrections = 0;
    while (Errors(positions) > kTolerance) {
      if (++corrections > kMaxCorrections) {
        DRAPE_CHECK(is_stale_,
                    "the direct solver does not converge: constraints that depend on "
                    "each other, or a step too large");
        Factor();
        corrections = 0;
      }
      const Eigen::VectorXd change = factors_.solve(error_);
      lambda_ += change;
      Apply(change, positions);
    }
    is_stale_ = true;
    if (corrections > kManyCorrections) is_factored_ = false;
  }

 private:
  // Two constraints that share a free particle: entry `slot` of the lower triangle gets
  // sign * w * d_a . d_b.
  struct Pair {
    int32_t slot = 0;
    uint32_t a = 0;
    uint32_t b = 0;
    double weight = 0;  // +-w, + where both constraints have the particle at the same end
  };

  std::span<const DistanceConstraint> constraints() const { return model_->constraints(); }

  void FindPairs() {
    struct End {
      uint32_t constraint;
      double sign;
    };
    std::vector<std::vector<End>> ends(model_->particle_count());
    for (uint32_t k = 0; k < model_->constraint_count(); ++k) {
      ends[constraints()[k].i].push_back({k, -1});
      ends[constraints()[k].j].push_back({k, 1});
    }
    std::vector<Eigen::Triplet<double>> pattern;
    const auto each_pair = [&](const auto& visit) {
      for (uint32_t i = 0; i < ends.size(); ++i) {
        const double w = model_->inverse_masses_per_kg()[i];
        if (w == 0) continue;
        for (const End& a : ends[i]) {
          for (const End& b : ends[i]) {
            if (a.constraint >= b.constraint)
              visit(a.constraint, b.constraint, a.sign * b.sign * w);
          }
        }
      }
    };
    each_pair([&](uint32_t a, uint32_t b, double) {
      pattern.emplace_back(static_cast<int>(a), static_cast<int>(b), 1.0);
    });
    const auto n = static_cast<Eigen::Index>(model_->constraint_count());
    matrix_.resize(n, n);
    matrix_.setFromTriplets(pattern.begin(), pattern.end());
    each_pair([&](uint32_t a, uint32_t b, double weight) {
      const double* entry = &matrix_.coeffRef(static_cast<int>(a), static_cast<int>(b));
      pairs_.push_back({static_cast<int32_t>(entry - matrix_.valuePtr()), a, b, weight});
    });
  }

  void SetDirections(const std::vector<Vector3d>& positions) {
    directions_.resize(model_->constraint_count());
    for (size_t k = 0; k < directions_.size(); ++k) {
      const DistanceConstraint& c = constraints()[k];
      directions_[k] = (positions[c.j] - positions[c.i]) / c.rest_length_m;
    }
  }

  void Factor() {
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    for (const Pair& pair : pairs_) {
      matrix_.valuePtr()[pair.slot] += pair.weight * directions_[pair.a].dot(directions_[pair.b]);
    }
    factors_.factorize(matrix_);
    const bool is_sound = factors_.info() == Eigen::Success &&
                          factors_.vectorD().minCoeff() > 1e-9 * factors_.vectorD().maxCoeff();
    DRAPE_CHECK(is_sound, "the direct solver needs constraints that are independent");
    is_factored_ = true;
    is_stale_ = false;
  }

  // Fills error_ and returns the largest, relative to the rest length.
  double Errors(const std::vector<Vector3d>& positions) {
    double largest = 0;
    for (size_t k = 0; k < directions_.size(); ++k) {
      const DistanceConstraint& c = constraints()[k];
      const double l = c.rest_length_m;
      const double error = ((positions[c.j] - positions[c.i]).squaredNorm() - l * l) / (2 * l);
      error_[static_cast<Eigen::Index>(k)] = error;
      // NaN must not count as converged.
      largest = std::isfinite(error) ? std::max(largest, std::abs(error) / l) : HUGE_VAL;
    }
    return largest;
  }

  void Apply(const Eigen::VectorXd& lambda, std::vector<Vector3d>& positions) const {
    const auto w = model_->inverse_masses_per_kg();
    for (size_t k = 0; k < directions_.size(); ++k) {
      const DistanceConstraint& c = constraints()[k];
      const Vector3d impulse = lambda[static_cast<Eigen::Index>(k)] * directions_[k];
      positions[c.i] += w[c.i] * impulse;
      positions[c.j] -= w[c.j] * impulse;
    }
  }

  std::shared_ptr<const SceneModel> model_;
  std::vector<Pair> pairs_;
  std::vector<Vector3d> directions_;
  Eigen::SparseMatrix<double> matrix_;  // lower triangle of J W J^T
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  Eigen::VectorXd lambda_;
  Eigen::VectorXd error_;
  bool is_factored_ = false;
  bool is_stale_ = true;  // factored at an earlier step
};

DirectSolver::DirectSolver(std::shared_ptr<const SceneModel> model, ParticleState start,
                           const Vector3d& gravity_m_per_s2)
    : impulses_(std::make_unique<Impulses>(std::move(model))),
      state_(std::move(start)),
      gravity_(gravity_m_per_s2) {}

DirectSolver::~DirectSolver() = default;
DirectSolver::DirectSolver(DirectSolver&&) noexcept = default;

const ParticleState& DirectSolver::state() const {
  return state_;
}

void DirectSolver::Advance(double duration_s, uint32_t steps) {
  const double h = duration_s / steps;
  std::vector<Vector3d>& x = state_.positions_m;
  std::vector<Vector3d>& v = state_.velocities_m_per_s;
  std::vector<Vector3d> next(x.size());
  for (uint32_t step = 0; step < steps; ++step) {
    for (size_t i = 0; i < x.size(); ++i) {
      const bool is_pinned = impulses_->IsPinned(i);
      next[i] = is_pinned ? x[i] : Vector3d(x[i] + h * v[i] + h * h / 2 * gravity_);
    }
    impulses_->Project(x, next);
    for (size_t i = 0; i < x.size(); ++i) {
      v[i] = impulses_->IsPinned(i) ? Vector3d(Vector3d::Zero())
                                    : Vector3d((next[i] - x[i]) / h + h / 2 * gravity_);
    }
    x.swap(next);
  }
}

namespace {

double LargestDistance(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

std::vector<Vector3d> Extrapolate(const std::vector<Vector3d>& coarse,
                                  const std::vector<Vector3d>& fine) {
  std::vector<Vector3d> result(fine.size());
  for (size_t i = 0; i < fine.size(); ++i) result[i] = (4 * fine[i] - coarse[i]) / 3;
  return result;
}

}  // namespace

ConvergedMotion ConvergeDirect(const std::shared_ptr<const SceneModel>& model,
                               const ParticleState& start, const Vector3d& gravity_m_per_s2,
                               double duration_s, uint32_t first_steps, uint32_t max_steps,
                               double tolerance_m) {
  ConvergedMotion motion;
  motion.error_m = HUGE_VAL;
  std::vector<Vector3d> coarse;
  double last_change = 0;
  for (uint32_t steps = first_steps; steps <= max_steps; steps *= 2) {
    DirectSolver solver(model, start, gravity_m_per_s2);
    solver.Advance(duration_s, steps);
    const std::vector<Vector3d>& fine = solver.state().positions_m;
    motion.step_s = duration_s / steps;
    if (!coarse.empty()) {
      motion.change_m = LargestDistance(coarse, fine);
      if (last_change > 0) motion.order = std::log2(last_change / motion.change_m);
      last_change = motion.change_m;
      std::vector<Vector3d> better = Extrapolate(coarse, fine);
      if (!motion.positions_m.empty()) motion.error_m = LargestDistance(motion.positions_m, better);
      motion.positions_m = std::move(better);
      if (motion.error_m <= tolerance_m) break;
    }
    coarse = fine;
  }
  DRAPE_CHECK(std::isfinite(motion.error_m), "at least three runs");
  return motion;
}

}  // namespace drape::bench
