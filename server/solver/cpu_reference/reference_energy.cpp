#include "server/solver/cpu_reference/reference_energy.h"

#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_context.h"

namespace drape::reference {
namespace {

using Eigen::Vector3d;

EnergyChange ChangeOfEnergy(const StepContext& context, const ReferenceCloth& cloth) {
  const SceneModel& model = context.model;
  const auto& [p, v] = cloth.state;
  EnergyChange change;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (context.w[i] == 0) continue;
    const Vector3d& v_end = context.state.velocities_m_per_s[i];
    const Vector3d way = context.state.positions_m[i] - p[i];
    change.start_kinetic_j += model.masses_kg()[i] * v[i].squaredNorm() / 2;
    change.gain_j += model.masses_kg()[i] * ((v_end - v[i]).dot(v_end + v[i]) / 2 -
                                             context.parameters.gravity_m_per_s2.dot(way));
  }
  return change;
}

double StoredOf(const SceneModel& model, const EnergyLimit& limit, const ParticleState& state) {
  const auto position_of = [&](uint32_t i) { return state.positions_m[i]; };
  return StoredEnergy_j(model, limit.max_elastic_frequency_sq_per_s2, position_of);
}

// From the velocities that the step ends with. Returns how much.
double TakeEnergy(StepContext& context, double excess_j) {
  const auto for_each_free = [&](const auto& function) {
    for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
      if (context.w[i] == 0) continue;
      function(context.model.masses_kg()[i], context.state.velocities_m_per_s[i]);
    }
  };
  return TakeEnergy_j(excess_j, !context.held.empty(), for_each_free);
}

bool MovesWhatItHolds(const StepContext& context, const ReferenceCloth& cloth) {
  return std::ranges::any_of(context.held, [&](const Grip& held) {
    return held.target_m != cloth.state.positions_m[held.particle];
  });
}

}  // namespace

bool GainEnergy(StepContexts& contexts, std::span<const SteppedReference> cloths,
                std::span<const EnergyLimit> limits, bool may_be_calmer,
                std::optional<EnergyBalance>& balance) {
  balance.reset();
  if (!std::ranges::all_of(limits, &EnergyLimit::is_watched)) return false;
  double gain_j = 0, allowed_j = 0;
  bool is_held_moved = false;
  EnergyChange change;  // of the last one
  for (size_t k = 0; k < cloths.size(); ++k) {
    change = ChangeOfEnergy(contexts[k], *cloths[k].cloth);
    gain_j += change.gain_j;
    allowed_j += limits[k].Allowed_j(change.start_kinetic_j);
    is_held_moved = is_held_moved || MovesWhatItHolds(contexts[k], *cloths[k].cloth);
  }
  if (!std::isfinite(gain_j)) return true;
  if (cloths.size() == 1 && !limits[0].has_stores && !is_held_moved &&
      contexts[0].parameters.colliders.empty()) {
    const std::optional<EnergyBalance>& before = cloths[0].asked.energy;
    balance = limits[0].After(before.value_or(EnergyBalance{}), change);
    const double excess_j = before ? limits[0].Excess_j(*balance, change) : 0;
    if (excess_j > 0 && !may_be_calmer) balance->gain_j -= TakeEnergy(contexts[0], excess_j);
    if (excess_j > 0) return true;
  }
  const bool looks_on = std::ranges::any_of(limits, &EnergyLimit::watches_stores);
  if (is_held_moved || (gain_j <= allowed_j && !looks_on)) return false;
  allowed_j = 0;
  for (size_t k = 0; k < cloths.size(); ++k) {
    const ReferenceCloth& cloth = *cloths[k].cloth;
    double start_j = 0;  // stored
    if (limits[k].has_stores) {
      start_j = StoredOf(*cloth.model, limits[k], cloth.state);
      gain_j += StoredOf(*cloth.model, limits[k], contexts[k].state) - start_j;
    }
    allowed_j += limits[k].Allowed_j(ChangeOfEnergy(contexts[k], cloth).start_kinetic_j, start_j);
  }
  return !std::isfinite(gain_j) || gain_j > allowed_j;
}

}  // namespace drape::reference
