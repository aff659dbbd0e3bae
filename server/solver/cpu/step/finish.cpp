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

// The new state replaces the old one unless it has blown up.
void Commit(const StepContext& context, bool may_have_fault, FloatState& state,
            StepReport& report) {
  report.fault = may_have_fault ? FindFault(context) : FaultReason::kNone;
  if (report.fault == FaultReason::kNone) std::swap(state, context.scratch.state);
}

}  // namespace

bool Finish(const StepContext& context, bool may_have_fault, bool measure, FloatState& state,
            StepReport& report) {
  if (context.scratch.reach.has_left) return false;
  report.warnings.not_converged = !report.converged;
  Commit(context, may_have_fault, state, report);
  if (measure) {
    report.measured = Measure(context, state, report.fault);
    report.warnings.strain_beyond_limit =
        report.measured.max_strain > context.controls.plan.strain_limit;
  }
  return true;
}

}  // namespace drape::cpu
