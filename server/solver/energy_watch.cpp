#include "server/solver/energy_watch.h"

#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape {
namespace {

bool CanGetEnergy(const SceneModel& model, const ClothParameters& parameters,
                  LengthSource lengths) {
  const bool feels_wind =
      (parameters.air_drag > 0 || parameters.air_lift > 0) && !parameters.wind_m_per_s.isZero(0);
  return model.spring_count() > 0 || lengths == LengthSource::kOwn || feels_wind ||
         HasMovingColliders(parameters);
}

}  // namespace

double EnergyLimit::Allowed_j(double start_kinetic_j, double start_stored_j) const {
  return colliders_j + kMaxEnergyGain * (scale_j + start_kinetic_j + start_stored_j) +
         lag_root_j * std::sqrt(start_kinetic_j);
}

EnergyBalance EnergyLimit::After(const EnergyBalance& before, const EnergyChange& step) const {
  const bool begins = before.scale_j == 0;
  return {before.gain_j + step.gain_j, begins ? scale_j + step.start_kinetic_j : before.scale_j};
}

double EnergyLimit::Excess_j(const EnergyBalance& after, const EnergyChange& step) const {
  const double allowed_j = kMaxEnergyGrowth * after.scale_j +
                           kMaxEnergyDrift * step.start_kinetic_j +
                           lag_root_j * std::sqrt(step.start_kinetic_j);
  return std::max(std::min(step.gain_j, after.gain_j - allowed_j), 0.0);
}

double ShareOfVelocities(double kinetic_j, double excess_j) {
  return excess_j < kinetic_j ? std::sqrt(1 - excess_j / kinetic_j) : 0;
}

EnergyLimit EnergyLimitOf(const SceneModel& model, const ClothParameters& parameters,
                          LengthSource lengths, const StepPlan& plan) {
  if (CanGetEnergy(model, parameters, lengths)) return {};
  const StepSettings& settings = parameters.settings;
  const double gravity = parameters.gravity_m_per_s2.norm();
  const double mass_kg = model.total_mass_kg();
  const bool has_compliance = model.has_compliance() || model.has_joint_compliance();
  EnergyLimit limit{.is_watched = true,
                    .has_stores = has_compliance || model.elastic_count() > 0,
                    .watches_stores = has_compliance && !plan.solver.has_strips &&
                                      plan.schedule.size() < kFewSubsteps,
                    .max_elastic_frequency_sq_per_s2 = plan.max_elastic_frequency_sq_per_s2};
  limit.scale_j = mass_kg * std::max(gravity, kLeastWatchedGravity_m_per_s2) * model.extent_m();
  if (!parameters.colliders.empty()) {
    constexpr double kSpeed = kMaxDepenetrationSpeed_m_per_s;
    limit.colliders_j = mass_kg * kSpeed * (kSpeed / 2 + gravity * settings.time_step_s);
  }
  // m v.(g h/2) at both ends, of all particles at most sqrt(2 m K) |g| h/2.
  if (!plan.solver.has_two_steps) {
    limit.lag_root_j = std::sqrt(2 * mass_kg) * gravity * settings.substep_s();
  }
  return limit;
}

bool HasCalmerScheme(const StepPlan& plan) {
  return plan.solver.has_two_steps || plan.solver.has_start_directions();
}

ClothParameters WithCalmerScheme(const ClothParameters& parameters) {
  ClothParameters calmer = parameters;
  calmer.settings.integration = Integration::kOneStep;
  calmer.settings.direction = Direction::kAtEnd;
  calmer.settings.velocity_iterations = 0;
  return calmer;
}

}  // namespace drape
