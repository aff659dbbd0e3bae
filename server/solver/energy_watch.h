// Whether a step gives a cloth energy that nothing gave to it: then it is done again, more
// dissipatively (server/solver/method.md, "Energy watch").
#pragma once

#include <algorithm>

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"

namespace drape {

// What a step may add to a cloth's energy [J], as a function of the kinetic energy at its start and
// of that of its compliant links and joints. Without such a limit any gain is allowed.
struct EnergyLimit {
  bool is_watched = false;
  // The energy of compliant links and joints counts. It need not be known where kinetic and
  // potential energy alone stay below the limit.
  bool counts_compliance = false;
  double constant_j = 0;
  double lag_root_j = 0;  // times the root of the kinetic energy [J^1/2]

  double Allowed_j(double start_kinetic_j, double start_compliant_j = 0) const;
  // A gain that is not a finite number is too much.
  bool IsExceeded(double gain_j, double start_kinetic_j, double start_compliant_j = 0) const;
};

// The energy of all compliant links and joints [J], with the lengths of the model.
// `position_of(particle)`: an Eigen::Vector3d [m].
template <class PositionOf>
double CompliantEnergy_j(const SceneModel& model, const PositionOf& position_of) {
  double energy_j = 0;
  for (const DistanceConstraint& link : model.constraints()) {
    if (link.compliance_m_per_n == 0) continue;
    double error_m = (position_of(link.j) - position_of(link.i)).norm() - link.rest_length_m;
    if (link.kind == ConstraintKind::kAtMost) error_m = std::max(error_m, 0.0);
    if (link.kind == ConstraintKind::kAtLeast) error_m = std::min(error_m, 0.0);
    energy_j += error_m * error_m / (2 * link.compliance_m_per_n);
  }
  for (const auto& [i, j, compliance_m_per_n] : model.joints()) {
    if (compliance_m_per_n == 0) continue;
    energy_j += (position_of(j) - position_of(i)).squaredNorm() / (2 * compliance_m_per_n);
  }
  return energy_j;
}

// Watched are cloths on which nothing can act that gives energy, as long as their pins rest: they
// have neither springs nor elastic elements, driven lengths, wind nor moving colliders.
// The limit is kMaxEnergyGain of m |g| l plus the kinetic energy; what colliders may do to
// particles inside them; and the half step of gravity that velocities of one step contain. Pure.
EnergyLimit EnergyLimitOf(const SceneModel& model, const ClothParameters& parameters,
                          LengthSource lengths, const StepPlan& plan);

// Whether there is a more dissipative scheme than the plan's: one step along end directions.
bool HasCalmerScheme(const StepPlan& plan);
ClothParameters WithCalmerScheme(const ClothParameters& parameters);

}  // namespace drape
