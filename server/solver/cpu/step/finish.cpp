#include "server/solver/cpu/step/finish.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

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

// Of all particles, from the start of the step to its end.
struct EnergyChange {
  double start_kinetic_j = 0;
  double gain_j = 0;
};

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

double CompliantEnergyOf(const StepContext& context, const FloatState& state) {
  return CompliantEnergy_j(*context.model.source,
                           [&](uint32_t i) { return ToVector3d(state.positions[i]); });
}

// More than it may, or no finite number. What is held and moved does work.
bool GainsEnergy(const StepContext& context, const FloatState& start) {
  const EnergyLimit& limit = context.controls.energy_limit;
  if (!limit.is_watched) return false;
  const EnergyChange change = ChangeOfEnergy(context, start);
  if (!std::isfinite(change.gain_j)) return true;
  const HeldParticles& held = context.held;
  for (size_t k = 0; k < held.particles.size(); ++k) {
    const Vec4 way = held.targets[k] - start.positions[held.particles[k]];
    if (Dot(way, way) > 0) return false;
  }
  if (!limit.IsExceeded(change.gain_j, change.start_kinetic_j)) return false;
  if (!limit.counts_compliance) return true;
  const double start_j = CompliantEnergyOf(context, start);
  const double gain_j = change.gain_j + CompliantEnergyOf(context, context.scratch.state) - start_j;
  return limit.IsExceeded(gain_j, change.start_kinetic_j, start_j);
}

// The new state replaces the old one unless it has blown up.
void Commit(const StepContext& context, bool may_have_fault, FloatState& state,
            StepReport& report) {
  report.fault = may_have_fault ? FindFault(context) : FaultReason::kNone;
  if (report.fault == FaultReason::kNone) std::swap(state, context.scratch.state);
}

}  // namespace

Ending Finish(const StepContext& context, bool may_have_fault, bool measure, FloatState& state,
              StepReport& report) {
  if (context.scratch.reach.has_left) return Ending::kWithAllColliders;
  if (GainsEnergy(context, state)) {
    if (context.calmer_controls != nullptr) return Ending::kCalmer;
    report.warnings.energy_gained = true;
  }
  report.warnings.not_converged = !report.converged;
  Commit(context, may_have_fault, state, report);
  if (measure) {
    report.measured = Measure(context, state, report.fault);
    report.warnings.strain_beyond_limit =
        report.measured.max_strain > context.controls.plan.strain_limit;
  }
  return Ending::kDone;
}

}  // namespace drape::cpu
