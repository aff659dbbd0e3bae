// What may change about a cloth while it runs without a new model.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
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
  double restitution = 0;                 // [0, 1]; share of the approach speed that a hit leaves
  double thickness_m = 0;                 // >= 0; gap = distance to the collider - thickness
  double air_drag = 0;                    // drag coefficient, [0, kMaxAirCoefficient]
  double air_lift = 0;                    // lift coefficient, [0, kMaxAirCoefficient]
  std::vector<Collider> colliders;
  // How they move from the next step on, [colliders.size()]; empty: all of them rest as described.
  std::vector<RigidMotion> collider_motions;
  StepSettings settings;
};

// Whether the stage `apply_wind` has anything to do. Cloths without triangles feel no air.
inline bool HasAirForces(const SceneModel& model, const ClothParameters& parameters) {
  return !model.triangles().empty() && (parameters.air_drag > 0 || parameters.air_lift > 0);
}

// Whether colliders move, or rest elsewhere than described.
inline bool HasMovingColliders(const ClothParameters& parameters) {
  return !parameters.collider_motions.empty();
}

// Whether particles may bounce off colliders.
inline bool HasRestitution(const ClothParameters& parameters) {
  return !parameters.colliders.empty() && parameters.restitution > 0;
}

// Slowest approach to a collider that is a hit, from which a particle bounces [m/s]: what gravity
// makes in kReboundSubsteps substeps.
inline double SlowestRebound(const ClothParameters& parameters) {
  return kReboundSubsteps * parameters.gravity_m_per_s2.norm() * parameters.settings.substep_s();
}

// Which solvers a cloth's sweeps have and how it is advanced: what its settings ask for, as far as
// it suits the cloth.
struct SolverChoice {
  bool has_strips = false;
  bool has_colours = false;
  bool has_two_steps = false;
  // Strain from which links that the last sweep of a step leaves are refined; 0: none are.
  double refine_above_strain = 0;
  uint32_t refine_rounds = 0;  // of that, at most
  uint32_t refine_solves = 0;  // links moved by it after which there is no further round
  // Of the direction of a link at the end of the substep in that of its impulses; the rest is the
  // one at its start. [0, 1].
  double end_share = 1;
  uint32_t velocity_iterations = 0;
};

// How far start directions are from where they are unstable: Gamma = h^2 T / (m L) of the worst
// link, if it carried the whole weight of the cloth (server/solver/method.md, "Direction").
inline double WeightGamma(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double weight_n = model.total_mass_kg() * parameters.gravity_m_per_s2.norm();
  return h * h * weight_n * model.link_mobility();
}

// The same where each pin carries its part of the weight; without pins 0, as nothing pulls then.
// What one sweep per substep leaves of the errors grows with it: 10 to 20 % of the worst link at
// 0.4 to 0.5
// (`./run bench stability`).
inline double LoadRatio(const SceneModel& model, const ClothParameters& parameters) {
  return model.pin_count() == 0 ? 0 : WeightGamma(model, parameters) / model.pin_count();
}

// What a backend gets: as many substeps as keep the load within settings.load_limit.
inline ClothParameters RaiseSubsteps(const SceneModel& model, ClothParameters parameters) {
  StepSettings& settings = parameters.settings;
  if (settings.load_limit == 0) return parameters;
  const double excess = LoadRatio(model, parameters) / settings.load_limit;
  if (excess <= 1) return parameters;
  const double factor = std::min(std::sqrt(excess), kMaxLoadFactor);
  const double most = std::min<double>(kMaxSubsteps, settings.time_step_s / kMinSubstep_s);
  const double raised = std::min(std::ceil(settings.substeps * factor), std::floor(most));
  settings.substeps = std::max(settings.substeps, static_cast<uint32_t>(raised));
  return parameters;
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
  const auto share = [](double gamma, double begin, double end) {
    return std::clamp((gamma - begin) / (end - begin), 0.0, 1.0);
  };
  const double of_weight = share(WeightGamma(model, parameters), kBlendBegin, kBlendEnd);
  // A chain or a tree has no cells that could flutter; where masses differ much the weight on a pin
  // says little of a hem, and end directions stretch more.
  const bool has_cells = model.constraint_count() >= model.particle_count();
  if (!has_cells || model.held_mass_ratio() > kMaxHeldMassRatio) return of_weight;
  return std::max(of_weight, share(LoadRatio(model, parameters), kWhipBegin, kWhipEnd));
}

// Adds the refinement to a choice that is made otherwise. Not where the lengths are not met at the
// start already: if they contradict each other, moves would feed energy in every step. Strips of
// one phase leave nothing, those of meshes, of many phases, leave errors everywhere; what gives way
// has no strain to be measured by, and along start directions links that turn are left to the
// substeps. Never below the tolerance: a sweep that changed nothing has left nothing to refine. Not
// more rounds than substeps: of few substeps, many rounds took out less than some
// (tests/bench/notes/solver.md).
inline void ChooseRefinement(const SceneModel& model, const StepSettings& settings,
                             SolverChoice& choice) {
  const bool is_refined = settings.refine_above_strain > 0 && choice.has_strips &&
                          model.start_errors().max <= settings.refine_above_strain &&
                          model.strips().phase_count() == 2 && choice.end_share == 1 &&
                          !model.has_compliance();
  if (!is_refined) return;
  choice.refine_above_strain = std::max(settings.refine_above_strain, settings.tolerance);
  choice.refine_rounds = std::min(settings.substeps, kMaxRefineRounds);
  const double links = double{1} * model.constraint_count() * settings.substeps;
  choice.refine_solves = static_cast<uint32_t>(std::min(links * kRefineShare, 4e9));
}

// Strips hold plain constraints of the model's lengths only: with ropes, struts or
// `has_own_lengths` (driven rest lengths) the sweeps have colours. Two steps need strips and
// nothing abrupt: contacts are not smooth, springs alone are better off with velocity Verlet, and
// what colours and joints alone leave of the errors would gain energy, as would what strips leave
// where masses differ much (kMaxHeldMassRatio).
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
                         !has_spring_forces && model.held_mass_ratio() <= kMaxHeldMassRatio;
  if (!choice.has_two_steps) {
    choice.end_share = EndShare(model, parameters);
    if (!has_own_lengths) choice.velocity_iterations = settings.velocity_iterations;
  }
  ChooseRefinement(model, settings, choice);
  return choice;
}

// h^2 omega^2 of the fastest elastic element of a cloth. Above 1 the substep cannot follow it, and
// it is as soft as makes this 1 (server/solver/method.md, "apply_elastic").
inline double ElasticRatio(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  return h * h * model.elastic_frequency_sq_bound();
}

// Whether explicit springs may be unstable: velocity Verlet needs h^2 omega^2 < 4, two steps with
// the springs at the predicted positions less than the square of the golden ratio. Elastic elements
// use up their part of it.
inline bool AreSpringsBeyondLimit(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double limit = ChooseSolver(model, parameters, false).has_two_steps ? 2.618 : 4;
  const double ratio = h * h * model.spring_frequency_sq_bound();
  return model.spring_count() > 0 &&
         ratio + std::min(ElasticRatio(model, parameters), 1.0) >= limit;
}

// Rate at which the energy of springs in the force grows at most [1/s], constraints apart; <= 0: it
// does not. A mode of frequency w and damping d/k = s is multiplied per substep by the matrix of
// x += h v + h^2 a/2, v += h a, a = -w^2 (x + s v), whose determinant is the factor of the squared
// amplitude: 1 + w^2 h (h/2 - s). It grows with w. Damping of the cloth takes exp(-c h).
inline double SpringGain_per_s(const SceneModel& model, const ClothParameters& parameters) {
  if (model.spring_count() == 0 ||
      parameters.settings.spring_integration != SpringIntegration::kInForce) {
    return 0;
  }
  const double h = parameters.settings.substep_s();
  const double growth =
      model.spring_frequency_sq_bound() * h * (h / 2 - model.least_spring_damping_s());
  return std::log1p(std::max(growth, 0.0)) / h - parameters.damping_per_s;
}

inline bool MaySpringsGainEnergy(const SceneModel& model, const ClothParameters& parameters) {
  return SpringGain_per_s(model, parameters) > kMaxSpringGain_per_s;
}

// Whether the stage `damp_twist` has anything to do: cells are those of a grid.
inline bool HasTwistDamping(const SceneModel& model, const StepSettings& settings) {
  return settings.twist_damping_per_s > 0 && model.grid_columns() > 1 && model.grid_rows() > 1;
}

}  // namespace drape
