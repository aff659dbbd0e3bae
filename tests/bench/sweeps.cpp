#include "tests/bench/sweeps.h"

#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape::bench {

using Eigen::Vector3d;

SweepProblem PredictSubstep(const SceneModel& model, const ParticleState& state,
                            const Vector3d& gravity_m_per_s2, double substep_s) {
  SweepProblem problem{.inverse_masses_per_kg = model.inverse_masses_per_kg(),
                       .positions_m = state.positions_m,
                       .mean_velocities_m_per_s = {},
                       .substep_s = substep_s};
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    const bool is_pin = problem.inverse_masses_per_kg[i] == 0;
    problem.mean_velocities_m_per_s.push_back(
        is_pin ? Vector3d::Zero()
               : Vector3d(state.velocities_m_per_s[i] + gravity_m_per_s2 * (substep_s / 2)));
  }
  return problem;
}

bool Sweep(SweepProblem& problem, std::span<const DistanceConstraint> constraints,
           double tolerance) {
  const auto& w = problem.inverse_masses_per_kg;
  const auto& p = problem.positions_m;
  auto& u = problem.mean_velocities_m_per_s;
  const double h = problem.substep_s;
  bool has_changed = false;
  for (const DistanceConstraint& c : constraints) {
    const Vector3d d = (p[c.j] - p[c.i]) + h * (u[c.j] - u[c.i]);
    const double length = d.norm();
    const double error = length - c.rest_length_m;
    if (tolerance > 0 && !(std::abs(error) > tolerance * c.rest_length_m)) continue;
    const Vector3d n = length < kMinDirectionLength_m ? Vector3d::UnitX() : Vector3d(d / length);
    const double impulse = -error / h / (w[c.i] + w[c.j]);
    u[c.i] -= w[c.i] * impulse * n;
    u[c.j] += w[c.j] * impulse * n;
    has_changed = true;
  }
  return has_changed;
}

uint32_t SweepsUntil(SweepProblem problem, std::span<const DistanceConstraint> constraints,
                     double tolerance, uint32_t max_sweeps) {
  uint32_t sweeps = 1;
  while (Sweep(problem, constraints, tolerance) && sweeps < max_sweeps) ++sweeps;
  return sweeps;
}

RelativeError ErrorAfter(SweepProblem problem, std::span<const DistanceConstraint> constraints,
                         uint32_t sweeps) {
  for (uint32_t sweep = 0; sweep < sweeps; ++sweep) Sweep(problem, constraints, 0);
  const auto& p = problem.positions_m;
  const auto& u = problem.mean_velocities_m_per_s;
  RelativeError error;
  double total_sq = 0;
  for (const DistanceConstraint& c : constraints) {
    const Vector3d d = (p[c.j] - p[c.i]) + problem.substep_s * (u[c.j] - u[c.i]);
    const double relative = std::abs(d.norm() - c.rest_length_m) / c.rest_length_m;
    error.max = std::max(error.max, relative);
    total_sq += relative * relative;
  }
  error.rms = std::sqrt(total_sq / static_cast<double>(constraints.size()));
  return error;
}

}  // namespace drape::bench
