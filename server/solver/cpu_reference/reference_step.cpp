#include "server/solver/cpu_reference/reference_step.h"

#include <limits>

#include "server/solver/cpu_reference/reference_measure.h"
#include "server/solver/cpu_reference/reference_stages.h"

namespace drape {

namespace reference {
namespace {

using Eigen::Vector3d;

// The forces that act on velocities for some time: each stage from the velocities that the last one
// left.
void Kick(const StepContext& context, double duration_s, const std::vector<Vector3d>& positions,
          std::vector<Vector3d>& velocities) {
  if (duration_s == 0) return;
  ApplySprings(context, duration_s, positions, velocities);
  ApplyElastic(context, duration_s, positions, velocities);
  ApplyWind(context, duration_s, positions, velocities);
}

// The same on the predicted velocities u, from the predicted positions b + h u.
void KickWithin(StepContext& context) {
  if (!context.substep.is_two_step) return;
  std::vector<Vector3d> predicted = context.base;
  for (size_t i = 0; i < predicted.size(); ++i) predicted[i] += context.h * context.u[i];
  Kick(context, context.substep.kick_within_s, predicted, context.u);
}

void AdvanceLengths(StepContext& context) {
  const uint32_t substeps = context.parameters.settings.substeps;
  context.rest_lengths.Advance(substeps - context.substep.pin_shares, substeps);
}

void ResetImpulses(StepContext& context) {
  context.lambda.assign(context.model.constraint_count(), 0.0);
  context.joint_lambda.assign(context.model.joint_count(), Vector3d::Zero());
  context.beta.assign(context.model.particle_count() * context.colliders.size(), {});
}

// Sweeps until none of them changes anything, at most max_iterations.
void Solve(StepContext& context, StepReport& report) {
  const double tolerance = context.plan.tolerance;
  for (uint32_t sweep = 0; sweep < context.max_iterations; ++sweep) {
    ++report.iterations;
    bool has_changed = SolveStrips(context);
    if (context.substep.is_last && sweep + 1 == context.max_iterations) Refine(context);
    has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveContacts(context);
    if (tolerance > 0 && !has_changed) return;
  }
  if (tolerance > 0) report.converged = false;
}

// No velocity along rigid links and joints is left.
void SolveVelocity(StepContext& context) {
  for (uint32_t sweep = 0; sweep < context.plan.solver.velocity_iterations; ++sweep) {
    SolveDistanceVelocities(context);
    SolveJointVelocities(context);
  }
}

// One substep. Returns the residual of its sweeps [m].
double Advance(StepContext& context, StepReport& report) {
  auto& [positions, velocities] = context.state;
  Kick(context, context.substep.kick_before_s, positions, velocities);
  PredictContacts(context);
  AccelerateBySprings(context);
  Predict(context);
  KickWithin(context);
  AdvanceLengths(context);
  SolveElastic(context);
  SolveHinges(context);
  DampTwist(context);
  Tether(context);
  ResetImpulses(context);
  Solve(context, report);
  const double residual = Residual(context);
  Integrate(context);
  SolveVelocity(context);
  CorrectVelocity(context);
  Kick(context, context.substep.kick_after_s, positions, velocities);
  return residual;
}

// The whole step but for commit and measure. Returns the residual of its last sweeps [m].
double DoSubsteps(StepContext& context, StepReport& report) {
  double residual = 0;
  for (uint32_t index = 0; index < context.plan.schedule.size(); ++index) {
    context.substep = context.plan.schedule[index];
    context.h = context.substep.interval_s;
    context.colliders.Place(index * context.substep.duration_s,
                            (index + 1) * context.substep.duration_s);
    residual = Advance(context, report);
  }
  // At the end of the step a pin is where it was asked to be, to the bit.
  for (const Grip& held : context.held) context.state.positions_m[held.particle] = held.target_m;
  return residual;
}

}  // namespace
}  // namespace reference

StepReport StepReferenceCloth(ReferenceCloth& cloth, bool measure, uint32_t max_iterations) {
  StepReport report;
  double residual = 0;
  double rms_motion = 0;
  double strain_limit = std::numeric_limits<double>::infinity();  // only a step has warnings
  if (cloth.fault == FaultReason::kNone) {
    const LengthSource lengths =
        cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel;
    const StepPlan plan = PlanStep(*cloth.model, cloth.parameters, lengths, ScalarType::kFloat64);
    reference::StepContext context(cloth, plan, max_iterations);
    residual = reference::DoSubsteps(context, report);
    report.warnings = plan.known_warnings;
    strain_limit = plan.strain_limit;
    report.warnings.not_converged = !report.converged;
    cloth.fault = FindFault(context.state);
    if (cloth.fault == FaultReason::kNone) {
      if (measure) rms_motion = RmsMotion(cloth.state, context.state);
      cloth.state = context.state;  // commit
      for (RigidMotion& motion : cloth.parameters.collider_motions) {
        motion = motion.After(cloth.parameters.settings.time_step_s);
      }
    } else {
      residual = 0;
    }
  }
  report.fault = cloth.fault;
  if (measure) {
    report.measured =
        MeasureState(*cloth.model, cloth.parameters, cloth.state, cloth.rest_length_targets_m);
    report.measured.max_residual_m = residual;
    report.measured.rms_motion_m = rms_motion;
    report.warnings.strain_beyond_limit = report.measured.max_strain > strain_limit;
  }
  return report;
}

}  // namespace drape
