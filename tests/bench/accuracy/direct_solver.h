// The motion of inextensible particle systems by a solver that shares neither method nor code with
// the product: SHAKE (Ryckaert, Ciccotti, Berendsen 1977) whose equations are solved exactly, by
// Newton's method with a sparse Cholesky factorisation (Eigen), in double precision. Second order
// in the step and symmetric in time, so that the error has even powers of h only.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"

namespace drape::bench {

// Distance constraints without compliance, pins that stay, gravity; no springs, contacts or
// damping. The constraints must be independent: a taut row between two pins is not, and ends the
// process with that reason.
class DirectSolver {
 public:
  DirectSolver(std::shared_ptr<const SceneModel> model, ParticleState start,
               const Eigen::Vector3d& gravity_m_per_s2);
  ~DirectSolver();
  DirectSolver(DirectSolver&&) noexcept;

  // Every constraint holds to kTolerance * rest length after each step.
  static constexpr double kTolerance = 1e-12;
  void Advance(double duration_s, uint32_t steps);

  const ParticleState& state() const;

 private:
  class Impulses;
  std::unique_ptr<Impulses> impulses_;
  ParticleState state_;
  Eigen::Vector3d gravity_;  // [m/s^2]
};

// The positions after `duration_s`, from runs with steps h, h/2, h/4, ...: the last two
// extrapolated, (4 x_{h/2} - x_h) / 3, which leaves an error of fourth order.
struct ConvergedMotion {
  std::vector<Eigen::Vector3d> positions_m;
  double step_s = 0;    // of the finest run
  double order = 0;     // measured from the last three runs; 2 if the runs are fine enough
  double change_m = 0;  // largest change of a particle from the last halving, not extrapolated
  // Largest difference of the last two extrapolated results: the error of the one before the last,
  // and a generous bound on that of `positions_m`.
  double error_m = 0;
};

// Halves the step, from `first_steps` on, until error_m <= tolerance_m or the next run would have
// more than max_steps. Bounded: look at error_m.
ConvergedMotion ConvergeDirect(const std::shared_ptr<const SceneModel>& model,
                               const ParticleState& start, const Eigen::Vector3d& gravity_m_per_s2,
                               double duration_s, uint32_t first_steps, uint32_t max_steps,
                               double tolerance_m);

}  // namespace drape::bench
