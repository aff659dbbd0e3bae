// Whether a step gives a cloth energy that nothing gave to it: then it is done again, more
// dissipatively (server/solver/method.md, "Energy watch").
#pragma once

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"

namespace drape {

// What a step may add to kinetic and potential energy [J], as a function of the kinetic energy at
// its start. Without such a limit any gain is allowed.
struct EnergyLimit {
  bool is_watched = false;
  double constant_j = 0;
  double lag_root_j = 0;  // times the root of the kinetic energy [J^1/2]

  bool IsExceeded(double gain_j, double start_kinetic_j) const;
};

// Watched are cloths on which nothing can act that gives energy, as long as their pins rest: they
// have neither springs nor elastic elements, compliance, driven lengths, wind nor moving colliders.
// The limit is kMaxEnergyGain of m |g| l plus the kinetic energy; what colliders may do to
// particles inside them; and the half step of gravity that velocities of one step contain. Pure.
EnergyLimit EnergyLimitOf(const SceneModel& model, const ClothParameters& parameters,
                          LengthSource lengths, const StepPlan& plan);

// Whether there is a more dissipative scheme than the plan's: one step along end directions.
bool HasCalmerScheme(const StepPlan& plan);
ClothParameters WithCalmerScheme(const ClothParameters& parameters);

}  // namespace drape
