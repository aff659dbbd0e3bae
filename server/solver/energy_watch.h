// Whether a step gives a cloth energy that nothing gave to it: then it is done again, more
// dissipatively (server/solver/method.md, "Energy watch").
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"

namespace drape {

// Of the free particles of a cloth, from the start of a step to its end, without what is stored.
struct EnergyChange {
  double start_kinetic_j = 0;
  double gain_j = 0;  // kinetic and potential
};

// What a step may add to a cloth's energy [J], as a function of the kinetic energy at its start and
// of what it stores then (StoredEnergy_j). Without such a limit any gain is allowed.
struct EnergyLimit {
  bool is_watched = false;
  // Something stores energy: compliant links and joints, elastic elements. It need not be known
  // where kinetic and potential energy alone stay below the limit,
  bool has_stores = false;
  // but where few sweeps solve them it may grow alone: links are stretched whose impulses have not
  // grown with them.
  bool watches_stores = false;
  double scale_j = 0;                          // m |g| l
  double colliders_j = 0;                      // what colliders may do to particles inside them
  double lag_root_j = 0;                       // times the root of the kinetic energy [J^1/2]
  double max_elastic_frequency_sq_per_s2 = 0;  // StepPlan's

  double Allowed_j(double start_kinetic_j, double start_stored_j = 0) const;

  // The balance after a step of which nothing else has part in it.
  EnergyBalance After(const EnergyBalance& before, const EnergyChange& step) const;
  // What of the step's gain is beyond what all steps together may add, at least 0 [J].
  double Excess_j(const EnergyBalance& after, const EnergyChange& step) const;
};

// By what velocities with this kinetic energy are multiplied to have so much less, at least 0 [-].
double ShareOfVelocities(double kinetic_j, double excess_j);

// Takes this energy from the velocities of the free particles of a cloth in equal shares, as far as
// they have it; those of a cloth that nothing holds keep their mean. Returns how much [J].
// `for_each_free(function)`: function(mass_kg, v) for each, v an Eigen::Vector3d that it may
// change.
template <class ForEachFree>
double TakeEnergy_j(double excess_j, bool is_held, const ForEachFree& for_each_free) {
  double mass_kg = 0, kinetic_j = 0;
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  for_each_free([&](double its_mass_kg, const Eigen::Vector3d& v) {
    mass_kg += its_mass_kg;
    momentum += its_mass_kg * v;
  });
  const Eigen::Vector3d mean = is_held ? Eigen::Vector3d(0, 0, 0) : momentum / mass_kg;
  for_each_free([&](double its_mass_kg, const Eigen::Vector3d& v) {
    kinetic_j += its_mass_kg * (v - mean).squaredNorm() / 2;
  });
  const double share = ShareOfVelocities(kinetic_j, excess_j);
  for_each_free([&](double, Eigen::Vector3d& v) { v = mean + share * (v - mean); });
  return (1 - share * share) * kinetic_j;
}

// The energy of all compliant links, joints and elastic elements [J], with the lengths of the
// model; elements that are too fast for a substep as they act. `position_of(particle)`: an
// Eigen::Vector3d [m].
template <class PositionOf>
double StoredEnergy_j(const SceneModel& model, double max_elastic_frequency_sq_per_s2,
                      const PositionOf& position_of) {
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
  const ElasticShares& shares = model.elastic_shares();
  for (size_t e = 0; e < model.elastic_elements().size(); ++e) {
    const double deflection_m = DeflectionOf_m(model.elastic_elements()[e], position_of);
    const double frequency_sq =
        std::min(shares.frequencies_sq_per_s2[e], max_elastic_frequency_sq_per_s2);
    energy_j += shares.masses_kg[e] * frequency_sq * deflection_m * deflection_m / 2;
  }
  return energy_j;
}

// Watched are cloths on which nothing can act that gives energy, as long as their pins rest: they
// have neither springs nor driven lengths, wind nor moving colliders.
// The limit is kMaxEnergyGain of m |g| l plus the kinetic energy; what colliders may do to
// particles inside them; and the half step of gravity that velocities of one step contain. Pure.
EnergyLimit EnergyLimitOf(const SceneModel& model, const ClothParameters& parameters,
                          LengthSource lengths, const StepPlan& plan);

// Whether there is a more dissipative scheme than the plan's: one step along end directions.
bool HasCalmerScheme(const StepPlan& plan);
ClothParameters WithCalmerScheme(const ClothParameters& parameters);

}  // namespace drape
