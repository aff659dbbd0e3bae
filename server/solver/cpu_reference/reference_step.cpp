#include "server/solver/cpu_reference/reference_step.h"

#include <cmath>
#include <limits>
#include <utility>

#include "server/solver/cpu_reference/reference_measure.h"
#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/energy_watch.h"

namespace drape {

namespace reference {

// How far a step is.
struct Progress {
  // The part of the substep that comes next.
  enum class Part { kBeforeSweeps, kSweeps, kVelocitySweeps };

  uint32_t substep = 0;  // under way
  Part part = Part::kBeforeSweeps;
  uint32_t sweep = 0;   // of the part
  double residual = 0;  // of the last sweeps [m]
  StepReport report{};
};
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

using Part = Progress::Part;

// Sweeps until none of them changes anything, at most max_iterations, and some more after hard
// hits. False: paused.
bool Solve(StepContext& context, Progress& progress, const Pause& pause) {
  const double tolerance = context.plan.tolerance;
  const auto sweeps = [&] {
    return context.plan.Has(StepStage::kSolveSelfContacts)
               ? context.self_contacts.contacts.SweepsOf(context.max_iterations)
               : context.max_iterations;
  };
  while (progress.sweep < sweeps()) {
    ++progress.report.iterations;
    bool has_changed = SolveStrips(context);
    if (context.substep.is_last && progress.sweep + 1 == context.max_iterations) Refine(context);
    has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveSelfContacts(context);
    has_changed |= SolveContacts(context);
    if (tolerance > 0 && !has_changed) return true;
    if (++progress.sweep < sweeps() && pause.IsDue()) return false;
  }
  if (tolerance > 0) progress.report.converged = false;
  return true;
}

// No velocity along rigid links and joints is left. False: paused.
bool SolveVelocity(StepContext& context, Progress& progress, const Pause& pause) {
  const uint32_t sweeps = context.plan.solver.velocity_iterations;
  while (progress.sweep < sweeps) {
    SolveDistanceVelocities(context);
    SolveJointVelocities(context);
    if (++progress.sweep < sweeps && pause.IsDue()) return false;
  }
  return true;
}

void BeforeSweeps(StepContext& context) {
  Kick(context, context.substep.kick_before_s, context.state.positions_m,
       context.state.velocities_m_per_s);
  PredictContacts(context);
  AccelerateBySprings(context);
  Predict(context);
  KickWithin(context);
  AdvanceLengths(context);
  SolveElastic(context);
  SolveHinges(context);
  DampTwist(context);
  Tether(context);
  FindSelfContacts(context);
  ResetImpulses(context);
}

// One substep, or what is left of it. False: paused.
bool Advance(StepContext& context, Progress& progress, const Pause& pause) {
  if (progress.part == Part::kBeforeSweeps) {
    BeforeSweeps(context);
    progress.part = Part::kSweeps;
    progress.sweep = 0;
  }
  if (progress.part == Part::kSweeps) {
    if (!Solve(context, progress, pause)) return false;
    progress.residual = Residual(context);
    Integrate(context);
    GuardSelfContacts(context);
    progress.part = Part::kVelocitySweeps;
    progress.sweep = 0;
  }
  if (!SolveVelocity(context, progress, pause)) return false;
  CorrectVelocity(context);
  Kick(context, context.substep.kick_after_s, context.state.positions_m,
       context.state.velocities_m_per_s);
  progress.part = Part::kBeforeSweeps;
  return true;
}

// The step but for commit and measure, or what is left of it. False: paused.
bool DoSubsteps(StepContext& context, Progress& progress, const Pause& pause) {
  while (progress.substep < context.plan.schedule.size()) {
    if (progress.part == Part::kBeforeSweeps) {
      if (context.impulses != nullptr) {
        context.impulses->SetWeights(ImpulseWeightsOf(context.plan.schedule, progress.substep,
                                                      context.parameters.damping_per_s));
      }
      context.substep = context.plan.schedule[progress.substep];
      context.h = context.substep.interval_s;
      context.colliders.Place(progress.substep * context.substep.duration_s,
                              (progress.substep + 1) * context.substep.duration_s);
    }
    if (!Advance(context, progress, pause)) return false;
    if (++progress.substep < context.plan.schedule.size() && pause.IsDue()) return false;
  }
  // At the end of the step a pin is where it was asked to be, to the bit.
  for (const Grip& held : context.held) context.state.positions_m[held.particle] = held.target_m;
  return true;
}

LengthSource LengthsOf(const ReferenceCloth& cloth) {
  return cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel;
}

StepPlan PlanOf(const ReferenceCloth& cloth, const ClothParameters& parameters) {
  return PlanStep(*cloth.model, parameters, LengthsOf(cloth), ScalarType::kFloat64);
}

// More than it may, or no finite number. What is held and moved does work.
bool GainsEnergy(const StepContext& context, const ReferenceCloth& cloth, const StepPlan& plan) {
  const SceneModel& model = context.model;
  const auto& [p, v] = cloth.state;
  double start_kinetic_j = 0, gain_j = 0;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (context.w[i] == 0) continue;
    const Vector3d& v_end = context.state.velocities_m_per_s[i];
    const Vector3d way = context.state.positions_m[i] - p[i];
    start_kinetic_j += model.masses_kg()[i] * v[i].squaredNorm() / 2;
    gain_j += model.masses_kg()[i] *
              ((v_end - v[i]).dot(v_end + v[i]) / 2 - context.parameters.gravity_m_per_s2.dot(way));
  }
  const EnergyLimit limit = EnergyLimitOf(model, cloth.parameters, LengthsOf(cloth), plan);
  if (limit.is_watched && !std::isfinite(gain_j)) return true;
  for (const Grip& held : context.held) {
    if (held.target_m != p[held.particle]) return false;
  }
  if (!limit.IsExceeded(gain_j, start_kinetic_j)) return false;
  if (!limit.counts_compliance) return true;
  const auto energy_of = [&](const ParticleState& state) {
    return CompliantEnergy_j(model, [&](uint32_t i) { return state.positions_m[i]; });
  };
  const double start_j = energy_of(cloth.state);
  return limit.IsExceeded(gain_j + energy_of(context.state) - start_j, start_kinetic_j, start_j);
}

}  // namespace
}  // namespace reference

struct ReferenceStep::UnderWay {
  UnderWay(const ReferenceCloth& cloth, const ClothParameters& parameters, const AskedOfStep& asked,
           uint32_t max_iterations)
      : plan(reference::PlanOf(cloth, parameters)),
        context(cloth, plan, asked, max_iterations),
        starts_crossing(reference::BeginSelfContacts(context, cloth.contact_surface.get(),
                                                     cloth.may_cross_itself)) {}

  const StepPlan plan;
  reference::StepContext context;
  const bool starts_crossing;
  reference::Progress progress;
};

ReferenceStep::ReferenceStep(ReferenceCloth& cloth, const AskedOfStep& asked,
                             uint32_t max_iterations)
    : cloth_(cloth),
      asked_(asked),
      max_iterations_(max_iterations),
      under_way_(cloth.fault == FaultReason::kNone
                     ? std::make_unique<UnderWay>(cloth, cloth.parameters, asked, max_iterations)
                     : nullptr) {}

ReferenceStep::~ReferenceStep() = default;

std::optional<StepReport> ReferenceStep::Continue(const Pause& pause) {
  StepReport report;
  double residual = 0;
  double rms_motion = 0;
  double strain_limit = std::numeric_limits<double>::infinity();  // only a step has warnings
  if (under_way_ != nullptr) {
    reference::StepContext& context = under_way_->context;
    if (!reference::DoSubsteps(context, under_way_->progress, pause)) return std::nullopt;
    const StepPlan plan = reference::PlanOf(cloth_, cloth_.parameters);
    if (!has_gained_energy_ && reference::GainsEnergy(context, cloth_, plan)) {
      has_gained_energy_ = true;
      if (HasCalmerScheme(plan)) {
        under_way_ = std::make_unique<UnderWay>(cloth_, WithCalmerScheme(cloth_.parameters), asked_,
                                                max_iterations_);
        return Continue(pause);
      }
    }
    report = under_way_->progress.report;
    residual = under_way_->progress.residual;
    report.warnings = plan.known_warnings;
    report.warnings.energy_gained = has_gained_energy_;
    report.warnings.starts_crossing = under_way_->starts_crossing;
    cloth_.may_cross_itself = under_way_->starts_crossing || context.self_contacts.has_failed;
    strain_limit = plan.strain_limit;
    report.warnings.not_converged = !report.converged;
    cloth_.fault = FindFault(context.state);
    if (cloth_.fault == FaultReason::kNone) {
      if (asked_.measure) rms_motion = RmsMotion(cloth_.state, context.state);
      if (context.impulses != nullptr) {
        report.impulses = std::make_shared<StepImpulses>(
            context.impulses->Total(cloth_.state, context.state, cloth_.parameters.gravity_m_per_s2,
                                    cloth_.parameters.settings.time_step_s));
      }
      cloth_.state = context.state;  // commit
      for (RigidMotion& motion : cloth_.parameters.collider_motions) {
        motion = motion.After(cloth_.parameters.settings.time_step_s);
      }
    } else {
      residual = 0;
    }
  }
  report.fault = cloth_.fault;
  if (asked_.measure) {
    report.measured =
        MeasureState(*cloth_.model, cloth_.parameters, cloth_.state, cloth_.rest_length_targets_m);
    if (cloth_.contact_surface != nullptr) {
      reference::MeasureSelfContacts(*cloth_.contact_surface, cloth_.parameters, cloth_.state,
                                     report.measured);
    }
    report.measured.max_residual_m = residual;
    report.measured.rms_motion_m = rms_motion;
    report.warnings.strain_beyond_limit = report.measured.max_strain > strain_limit;
  }
  return report;
}

StepReport StepReferenceCloth(ReferenceCloth& cloth, const AskedOfStep& asked,
                              uint32_t max_iterations) {
  return *ReferenceStep(cloth, asked, max_iterations).Continue(Pause::Never());
}

}  // namespace drape
