// The sweeps of one substep over distance constraints in any order, in double precision: the
// product always sweeps in the order of its colours, and these benchmarks measure the effect of the
// order.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"

namespace drape::bench {

// One substep after `predict`, all but the constraints solved: p + h u are the predicted positions.
// Inextensible constraints, no contacts, no springs.
struct SweepProblem {
  std::span<const double> inverse_masses_per_kg;
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<Eigen::Vector3d> mean_velocities_m_per_s;  // u
  double substep_s = 0;
};

// Pins stay where they are. The model must outlive the problem.
SweepProblem PredictSubstep(const SceneModel& model, const ParticleState& state,
                            const Eigen::Vector3d& gravity_m_per_s2, double substep_s);

// One sweep: for each constraint in the order given, the impulse that removes its error, if that is
// above tolerance * rest length (tolerance 0: always). Bender et al. 2009, section 3.2. Whether
// anything was changed.
bool Sweep(SweepProblem& problem, std::span<const DistanceConstraint> constraints,
           double tolerance);

// Sweeps until one changes nothing, that one counted; at most max_sweeps.
uint32_t SweepsUntil(SweepProblem problem, std::span<const DistanceConstraint> constraints,
                     double tolerance, uint32_t max_sweeps);

// |C| / rest length at the predicted positions.
struct RelativeError {
  double max = 0;
  double rms = 0;
};
RelativeError ErrorAfter(SweepProblem problem, std::span<const DistanceConstraint> constraints,
                         uint32_t sweeps);

}  // namespace drape::bench
