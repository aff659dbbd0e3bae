#include "server/solver/cpu/step/finish.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "server/solver/cpu/step/measure.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

bool IsFinite(Vec4 vector) {
  return std::isfinite(vector[0]) && std::isfinite(vector[1]) && std::isfinite(vector[2]);
}

bool IsRunaway(Vec4 p, Vec4 v) {
  const Vec4 distance = Abs(p);
  const float farthest = std::max({distance[0], distance[1], distance[2]});
  return farthest > static_cast<float>(kMaxCoordinate_m) ||
         Length(v) > static_cast<float>(kMaxSpeed_m_per_s);
}

FaultReason FindFault(const StepContext& context) {
  FloatState& state = context.scratch.state;
  std::atomic<bool> is_runaway = false;
  const bool is_infinite = context.team.AnyOf(
      0, state.positions.size(), kParticleGrain, [&](size_t begin, size_t end, uint32_t) {
        bool has_infinite = false, has_runaway = false;
        for (size_t i = begin; i < end; ++i) {
          const Vec4 p = state.positions[i], v = state.velocities[i];
          has_infinite |= !IsFinite(p) || !IsFinite(v);
          has_runaway |= IsRunaway(p, v);
        }
        if (has_runaway) is_runaway = true;
        return has_infinite;
      });
  if (is_infinite) return FaultReason::kNotFinite;
  return is_runaway ? FaultReason::kRunaway : FaultReason::kNone;
}

// In blocks, so that the sums in single precision stay short.
EnergyChange ChangeOfEnergy(const StepContext& context, const FloatState& start) {
  constexpr uint32_t kBlock = 64;
  const FloatState& end = context.scratch.state;
  const std::span<const float> masses = context.model.free_masses;
  EnergyChange change;
  for (uint32_t begin = 0; begin < context.model.particle_count; begin += kBlock) {
    Vec4 kinetic{}, gain{};
    const uint32_t block_end = std::min(begin + kBlock, context.model.particle_count);
    for (uint32_t i = begin; i < block_end; ++i) {
      const Vec4 v = start.velocities[i], v_change = end.velocities[i] - v;
      const Vec4 p_change = end.positions[i] - start.positions[i];
      const float mass = context.held.IsFree(i) ? masses[i] : 0;
      kinetic += mass * (v * v);
      gain += mass * (v_change * (v + 0.5f * v_change) - context.controls.gravity * p_change);
    }
    change.start_kinetic_j += 0.5 * (double{kinetic[0]} + kinetic[1] + kinetic[2]);
    change.gain_j += double{gain[0]} + gain[1] + gain[2];
  }
  return change;
}

double StoredEnergyOf(const StepContext& context, const FloatState& state) {
  return StoredEnergy_j(*context.model.source,
                        context.controls.energy_limit.max_elastic_frequency_sq_per_s2,
                        [&](uint32_t i) { return ToVector3d(state.positions[i]); });
}

// From the velocities that the step ends with. Returns how much.
double TakeEnergy(const StepContext& context, double excess_j) {
  FloatState& end = context.scratch.state;
  const auto for_each_free = [&](const auto& function) {
    for (const uint32_t i : context.held.free_particles) {
      Eigen::Vector3d v = ToVector3d(end.velocities[i]);
      function(double{context.model.free_masses[i]}, v);
      end.velocities[i] = ToVec4(v);
    }
  };
  return TakeEnergy_j(excess_j, !context.held.particles.empty(), for_each_free);
}

bool MovesWhatItHolds(const StepContext& context, const FloatState& start) {
  const HeldParticles& held = context.held;
  for (size_t k = 0; k < held.particles.size(); ++k) {
    const Vec4 way = held.targets[k] - start.positions[held.particles[k]];
    if (Dot(way, way) > 0) return true;
  }
  return false;
}

// Together more than they may, for one may give energy to another, or no finite number. What is
// held and moved does work. Tells the balance of a cloth of which nothing else has part in it.
bool GainEnergy(std::span<const EndingCloth> cloths) {
  const auto limit_of = [](const EndingCloth& cloth) -> const EnergyLimit& {
    return cloth.context.controls.energy_limit;
  };
  for (const EndingCloth& cloth : cloths) {
    if (!limit_of(cloth).is_watched) return false;
  }
  double gain_j = 0, allowed_j = 0;
  bool have_stores = false, watches_stores = false, is_held_moved = false;
  EnergyChange change;  // of the last one
  for (const EndingCloth& cloth : cloths) {
    change = ChangeOfEnergy(cloth.context, cloth.state);
    gain_j += change.gain_j;
    allowed_j += limit_of(cloth).Allowed_j(change.start_kinetic_j);
    have_stores |= limit_of(cloth).has_stores;
    watches_stores |= limit_of(cloth).watches_stores;
    is_held_moved = is_held_moved || MovesWhatItHolds(cloth.context, cloth.state);
  }
  if (!std::isfinite(gain_j)) return true;
  if (cloths.size() == 1 && !have_stores && !is_held_moved &&
      cloths[0].context.scratch.reach.near.empty()) {
    const StepContext& context = cloths[0].context;
    EnergyBalance after =
        limit_of(cloths[0]).After(context.energy.value_or(EnergyBalance{}), change);
    const double excess_j = context.energy ? limit_of(cloths[0]).Excess_j(after, change) : 0;
    if (excess_j > 0 && context.calmer_controls == nullptr) {
      after.gain_j -= TakeEnergy(context, excess_j);
    }
    cloths[0].report.energy = after;
    if (excess_j > 0) return true;
  }
  if (is_held_moved || (gain_j <= allowed_j && !watches_stores)) return false;
  if (!have_stores) return true;
  allowed_j = 0;
  for (const EndingCloth& cloth : cloths) {
    const double start_kinetic_j = ChangeOfEnergy(cloth.context, cloth.state).start_kinetic_j;
    const bool counts = limit_of(cloth).has_stores;
    const double start_j = counts ? StoredEnergyOf(cloth.context, cloth.state) : 0;
    if (counts) gain_j += StoredEnergyOf(cloth.context, cloth.context.scratch.state) - start_j;
    allowed_j += limit_of(cloth).Allowed_j(start_kinetic_j, start_j);
  }
  return !std::isfinite(gain_j) || gain_j > allowed_j;
}

// Whether none has one.
bool FindFaults(std::span<const EndingCloth> cloths) {
  bool is_good = true;
  for (const EndingCloth& cloth : cloths) {
    cloth.report.fault = cloth.may_have_fault ? FindFault(cloth.context) : FaultReason::kNone;
    if (cloth.report.fault == FaultReason::kNone) {
      cloth.report.fault = cloth.context.scratch.bodies.Fault();
    }
    is_good &= cloth.report.fault == FaultReason::kNone;
  }
  for (const EndingCloth& cloth : cloths) {
    if (!is_good && cloth.report.fault == FaultReason::kNone) {
      cloth.report.fault = FaultReason::kInWorld;
    }
  }
  return is_good;
}

// Of the states that the step ends with. Empty: nobody asks.
std::vector<self_contact::SelfContactMeasures> MeasureContacts(std::span<const EndingCloth> cloths,
                                                               bool is_good) {
  if (std::ranges::none_of(cloths, &EndingCloth::measure)) return {};
  std::vector<MeasuredCloth> measured;
  for (const EndingCloth& cloth : cloths) {
    measured.push_back({cloth.context, is_good ? cloth.context.scratch.state : cloth.state});
  }
  return MeasureSelfContacts(measured);
}

}  // namespace

Ending Finish(std::span<const EndingCloth> cloths) {
  const auto any = [&](const auto& is_true) { return std::ranges::any_of(cloths, is_true); };
  if (any([](const EndingCloth& cloth) { return cloth.context.scratch.reach.has_left; })) {
    return Ending::kWithAllColliders;
  }
  const bool gain_energy = GainEnergy(cloths);
  if (gain_energy &&
      any([](const EndingCloth& cloth) { return cloth.context.calmer_controls != nullptr; })) {
    return Ending::kCalmer;
  }
  for (const EndingCloth& cloth : cloths) {
    if (gain_energy) cloth.report.warnings.energy_gained = true;
    cloth.report.warnings.not_converged = !cloth.report.converged;
  }
  const bool is_good = FindFaults(cloths);
  // The step may be dropped in here: nothing has changed yet.
  const auto contacts = MeasureContacts(cloths, is_good);
  for (size_t k = 0; k < cloths.size(); ++k) {
    const EndingCloth& cloth = cloths[k];
    if (is_good) std::swap(cloth.state, cloth.context.scratch.state);
    if (!cloth.measure) continue;
    cloth.report.measured = Measure(cloth.context, cloth.state, cloth.report.fault);
    cloth.report.warnings.strain_beyond_limit =
        cloth.report.measured.max_strain > cloth.context.controls.plan.strain_limit;
    if (!contacts.empty()) Tell(contacts[k], cloth.report.measured);
  }
  return Ending::kDone;
}

}  // namespace drape::cpu
