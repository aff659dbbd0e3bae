// What may change about a cloth while it runs without a new model.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "server/scene/colliders.h"
#include "server/solver/solver_constants.h"
#include "server/solver/step_settings.h"

namespace drape {

// All in the cloth's own frame.
struct ClothParameters {
  Eigen::Vector3d gravity_m_per_s2{0, -9.81, 0};
  Eigen::Vector3d wind_m_per_s{0, 0, 0};  // velocity of the air; no effect without drag or lift
  double damping_per_s = 0;               // >= 0; v decays as exp(-damping t)
  double friction_static = 0;             // >= friction_dynamic
  double friction_dynamic = 0;            // >= 0
  double thickness_m = 0;                 // >= 0; gap = distance to the collider - thickness
  double air_drag = 0;                    // drag coefficient, [0, kMaxAirCoefficient]
  double air_lift = 0;                    // lift coefficient, [0, kMaxAirCoefficient]
  std::vector<Collider> colliders;
  StepSettings settings;
};

// Whether the stage `apply_wind` has anything to do. Cloths without triangles feel no air.
inline bool HasAirForces(const SceneModel& model, const ClothParameters& parameters) {
  return !model.triangles().empty() && (parameters.air_drag > 0 || parameters.air_lift > 0);
}

// Which solvers a cloth's sweeps have and how it is advanced: what its settings ask for, as far as
// it suits the cloth.
struct SolverChoice {
  bool has_strips = false;
  bool has_colours = false;
  bool has_two_steps = false;
  // Of the direction of a link at the end of the substep in that of its impulses; the rest is the
  // one at its start. [0, 1].
  double end_share = 1;
  uint32_t velocity_iterations = 0;
};

// How far start directions are from where they are unstable: Gamma = h^2 T / (m L) of the worst
// link, if it carried the whole weight of the cloth (server/solver/README.md, "Direction").
inline double WeightGamma(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double weight_n = model.total_mass_kg() * parameters.gravity_m_per_s2.norm();
  return h * h * weight_n * model.link_mobility();
}

// SolverChoice::end_share.
inline double EndShare(const SceneModel& model, const ClothParameters& parameters) {
  switch (parameters.settings.direction) {
    case Direction::kAtEnd:
      return 1;
    case Direction::kAtStart:
      return 0;
    case Direction::kBlended:
      break;
  }
  const double beyond = WeightGamma(model, parameters) - kBlendBegin;
  return std::clamp(beyond / (kBlendEnd - kBlendBegin), 0.0, 1.0);
}

// Strips hold plain constraints of the model's lengths only: with ropes, struts or
// `has_own_lengths` (driven rest lengths) the sweeps have colours. Two steps need strips and
// nothing abrupt: contacts are not smooth, springs alone are better off with velocity Verlet, and
// what colours and joints alone leave of the errors would gain energy.
inline SolverChoice ChooseSolver(const SceneModel& model, const ClothParameters& parameters,
                                 bool has_own_lengths) {
  const StepSettings& settings = parameters.settings;
  const bool has_spring_forces =
      model.spring_count() > 0 && settings.spring_integration == SpringIntegration::kInForce;
  SolverChoice choice;
  choice.has_strips =
      settings.sweep != Sweep::kColours && !model.has_inequalities() && !has_own_lengths;
  choice.has_colours = settings.sweep != Sweep::kStrips || !choice.has_strips;
  choice.has_two_steps = settings.integration == Integration::kTwoStep && choice.has_strips &&
                         settings.substeps > 1 && model.constraint_count() > 0 &&
                         model.joint_count() == 0 && parameters.colliders.empty() &&
                         !has_spring_forces;
  if (choice.has_two_steps) return choice;
  choice.end_share = EndShare(model, parameters);
  if (!has_own_lengths) choice.velocity_iterations = settings.velocity_iterations;
  return choice;
}

// Whether explicit springs may be unstable: velocity Verlet needs h^2 omega^2 < 4, two steps with
// the springs at the predicted positions less than the square of the golden ratio.
inline bool AreSpringsBeyondLimit(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double limit = ChooseSolver(model, parameters, false).has_two_steps ? 2.618 : 4;
  return h * h * model.spring_frequency_sq_bound() >= limit;
}

// Whether the stage `damp_twist` has anything to do: cells are those of a grid.
inline bool HasTwistDamping(const SceneModel& model, const StepSettings& settings) {
  return settings.twist_damping_per_s > 0 && model.grid_columns() > 1 && model.grid_rows() > 1;
}

}  // namespace drape
