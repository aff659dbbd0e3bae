#include "server/solver/cpu_reference/reference_step.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <span>
#include <utility>

#include "server/solver/cpu_reference/reference_energy.h"
#include "server/solver/cpu_reference/reference_measure.h"
#include "server/solver/cpu_reference/reference_parts.h"
#include "server/solver/cpu_reference/reference_self_contacts.h"
#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/energy_watch.h"
#include "server/solver/world_settings.h"

namespace drape {

namespace reference {

// How far a step is.
struct Progress {
  // The part of the substep that comes next.
  enum class Part { kBeforeSweeps, kSweeps, kIntegrate, kVelocitySweeps, kAfterSweeps };

  // Of one cloth.
  struct OfCloth {
    bool is_sweeping = true;   // in the substep under way
    bool has_changed = false;  // something in this sweep
    double residual = 0;       // of the last sweeps [m]
    StepReport report{};
  };

  uint32_t substep = 0;  // under way
  Part part = Part::kBeforeSweeps;
  uint32_t sweep = 0;                  // of the part
  bool have_contacts_changed = false;  // in this sweep
  // Done of the sweep, or of what else may pause within itself (Parts).
  uint32_t parts_done = 0;
  std::vector<OfCloth> cloths{};
};
namespace {

using Eigen::Vector3d;

// What a part takes at most, some milliseconds: of constraints or particles, and of strips.
constexpr uint32_t kPerPart = 1u << 14;
constexpr uint32_t kStripsPerPart = 16;

// The forces that act on velocities for some time: each stage from the velocities that the last one
// left.
void Kick(const StepContext& context, double duration_s, const std::vector<Vector3d>& positions,
          std::vector<Vector3d>& velocities, Parts& parts) {
  if (duration_s == 0) return;
  parts.Do([&] { ApplySprings(context, duration_s, positions, velocities); });
  parts.Do([&] { ApplyElastic(context, duration_s, positions, velocities); });
  parts.Do([&] { ApplyWind(context, duration_s, positions, velocities); });
}

// The same on the predicted velocities u, from the predicted positions b + h u.
void KickWithin(StepContext& context) {
  if (!context.substep.is_two_step) return;
  std::vector<Vector3d> predicted = context.base;
  for (size_t i = 0; i < predicted.size(); ++i) predicted[i] += context.h * context.u[i];
  const Pause never = Pause::Never();
  Parts parts(0, never);
  Kick(context, context.substep.kick_within_s, predicted, context.u, parts);
}

void AdvanceLengths(StepContext& context) {
  const uint32_t substeps = context.parameters.settings.substeps;
  context.rest_lengths.Advance(substeps - context.substep.pin_shares, substeps);
}

void ResetImpulses(StepContext& context) {
  context.lambda.assign(context.model.constraint_count(), 0.0);
  context.joint_lambda.assign(context.model.joint_count(), Vector3d::Zero());
  FillForContacts(context, ContactImpulse{}, context.beta);
}

using Part = Progress::Part;

// One sweep over the links and joints. Notes whether an error was larger than the tolerance.
void SweepLinks(StepContext& context, uint32_t sweep, Progress::OfCloth& its, Parts& parts) {
  const auto change = [&its](bool has_changed) { its.has_changed |= has_changed; };
  parts.Do([&] {
    ++its.report.iterations;
    its.has_changed = false;
  });
  parts.DoRanges(context.model.strips().strip_count(), kStripsPerPart,
                 [&](uint32_t begin, uint32_t end) { change(SolveStrips(context, begin, end)); });
  if (context.substep.is_last && sweep + 1 == context.max_iterations) {
    parts.Do([&] { Refine(context); });
  }
  parts.DoRanges(context.model.constraint_count(), kPerPart,
                 [&](uint32_t begin, uint32_t end) { change(SolveDistance(context, begin, end)); });
  parts.Do([&] { change(SolveJoints(context)); });
}

// One sweep of all cloths. A cloth in which nothing changes any more waits for those of its world,
// until contacts change something again.
void Sweep(StepContexts& contexts, ReferenceSelfContacts& self_contacts, Progress& progress,
           Parts& parts) {
  for (size_t k = 0; k < contexts.size(); ++k) {
    Progress::OfCloth& its = progress.cloths[k];
    if (its.is_sweeping) SweepLinks(contexts[k], progress.sweep, its, parts);
  }
  parts.Do([&] { progress.have_contacts_changed = self_contacts.Solve(contexts); });
  for (size_t k = 0; k < contexts.size(); ++k) {
    Progress::OfCloth& its = progress.cloths[k];
    if (!its.is_sweeping) continue;
    parts.Do([&] { its.has_changed |= SolveBodies(contexts[k]); });
    parts.Do([&] { its.has_changed |= contexts[k].surface_contacts.Solve(contexts[k]); });
    parts.DoRanges(contexts[k].model.particle_count(), kPerPart, [&](uint32_t begin, uint32_t end) {
      its.has_changed |= SolveContacts(contexts[k], begin, end);
    });
  }
}

// Sweeps until none of them changes anything, at most max_iterations, and some more after hard
// hits. False: paused.
bool Solve(StepContexts& contexts, ReferenceSelfContacts& self_contacts, Progress& progress,
           const Pause& pause) {
  // A sweep that has begun is ended, whatever has hit meanwhile.
  while (progress.parts_done > 0 || progress.sweep < self_contacts.SweepsAfterHits(contexts)) {
    const bool is_done = DoParts(
        progress, pause, [&](Parts& parts) { Sweep(contexts, self_contacts, progress, parts); });
    if (!is_done) return false;
    bool is_over = true;
    for (size_t k = 0; k < contexts.size(); ++k) {
      Progress::OfCloth& its = progress.cloths[k];
      its.is_sweeping = contexts[k].plan.tolerance == 0 || progress.have_contacts_changed ||
                        (its.is_sweeping && its.has_changed);
      is_over &= !its.is_sweeping;
    }
    if (is_over) return true;
    ++progress.sweep;
  }
  for (size_t k = 0; k < contexts.size(); ++k) {
    Progress::OfCloth& its = progress.cloths[k];
    if (contexts[k].plan.tolerance > 0 && its.is_sweeping) its.report.converged = false;
  }
  return true;
}

// No velocity along rigid links and joints is left. False: paused.
bool SolveVelocity(StepContexts& contexts, Progress& progress, const Pause& pause) {
  uint32_t sweeps = 0;
  for (const StepContext& context : contexts) {
    sweeps = std::max(sweeps, context.plan.solver.velocity_iterations);
  }
  for (; progress.sweep < sweeps; ++progress.sweep) {
    const bool is_done = DoParts(progress, pause, [&](Parts& parts) {
      for (StepContext& context : contexts) {
        if (progress.sweep >= context.plan.solver.velocity_iterations) continue;
        parts.DoRanges(
            context.model.constraint_count(), kPerPart,
            [&](uint32_t begin, uint32_t end) { SolveDistanceVelocities(context, begin, end); });
        parts.Do([&] { SolveJointVelocities(context); });
      }
    });
    if (!is_done) return false;
  }
  return true;
}

void BeforeSweeps(StepContext& context, Parts& parts) {
  Kick(context, context.substep.kick_before_s, context.state.positions_m,
       context.state.velocities_m_per_s, parts);
  parts.Do([&] { PredictContacts(context); });
  parts.Do([&] { context.surface_contacts.Find(context); });
  parts.Do([&] { PredictBodies(context); });
  parts.Do([&] { AccelerateBySprings(context); });
  parts.Do([&] { Predict(context); });
  parts.Do([&] { KickWithin(context); });
  parts.Do([&] { AdvanceLengths(context); });
  parts.Do([&] { SolveElastic(context); });
  parts.Do([&] { SolveHinges(context); });
  parts.Do([&] { DampTwist(context); });
  parts.Do([&] { Tether(context); });
}

// One substep, or what is left of it. False: paused.
bool Advance(StepContexts& contexts, ReferenceSelfContacts& self_contacts, Progress& progress,
             const Pause& pause) {
  if (progress.part == Part::kBeforeSweeps) {
    const bool is_done = DoParts(progress, pause, [&](Parts& parts) {
      for (StepContext& context : contexts) BeforeSweeps(context, parts);
      parts.Do([&] { self_contacts.Find(contexts); });
      for (StepContext& context : contexts) parts.Do([&] { ResetImpulses(context); });
    });
    if (!is_done) return false;
    for (Progress::OfCloth& its : progress.cloths) its.is_sweeping = true;
    progress.part = Part::kSweeps;
    progress.sweep = 0;
  }
  if (progress.part == Part::kSweeps) {
    if (!Solve(contexts, self_contacts, progress, pause)) return false;
    progress.part = Part::kIntegrate;
  }
  if (progress.part == Part::kIntegrate) {
    const bool is_done = DoParts(progress, pause, [&](Parts& parts) {
      for (size_t k = 0; k < contexts.size(); ++k) {
        parts.Do([&] { progress.cloths[k].residual = Residual(contexts[k]); });
        parts.Do([&] { Integrate(contexts[k]); });
        parts.Do([&] { IntegrateBodies(contexts[k]); });
      }
      parts.Do([&] { self_contacts.Guard(contexts); });
      for (StepContext& its : contexts) parts.Do([&] { its.surface_contacts.Advance(its); });
    });
    if (!is_done) return false;
    progress.part = Part::kVelocitySweeps;
    progress.sweep = 0;
  }
  if (progress.part == Part::kVelocitySweeps) {
    if (!SolveVelocity(contexts, progress, pause)) return false;
    progress.part = Part::kAfterSweeps;
  }
  const bool is_done = DoParts(progress, pause, [&](Parts& parts) {
    for (StepContext& context : contexts) {
      parts.Do([&] { CorrectBodies(context); });
      parts.Do([&] { context.surface_contacts.Correct(context); });
      parts.Do([&] { CorrectVelocity(context); });
      Kick(context, context.substep.kick_after_s, context.state.positions_m,
           context.state.velocities_m_per_s, parts);
    }
  });
  if (is_done) progress.part = Part::kBeforeSweeps;
  return is_done;
}

void BeginSubstep(StepContext& context, uint32_t index) {
  if (context.impulses != nullptr) {
    context.impulses->SetWeights(
        ImpulseWeightsOf(context.plan.schedule, index, context.parameters.damping_per_s));
  }
  context.substep = context.plan.schedule[index];
  context.h = context.substep.interval_s;
  context.colliders.Place(index * context.substep.duration_s,
                          (index + 1) * context.substep.duration_s);
  BeginBodies(context, index * context.substep.duration_s);
}

// The step but for commit and measure, or what is left of it. False: paused.
bool DoSubsteps(StepContexts& contexts, ReferenceSelfContacts& self_contacts, Progress& progress,
                const Pause& pause) {
  const uint32_t substeps = contexts[0].plan.schedule.size();
  while (progress.substep < substeps) {
    if (progress.part == Part::kBeforeSweeps && progress.parts_done == 0) {
      for (StepContext& context : contexts) BeginSubstep(context, progress.substep);
    }
    if (!Advance(contexts, self_contacts, progress, pause)) return false;
    ++progress.substep;
  }
  // At the end of the step a pin is where it was asked to be, to the bit.
  for (StepContext& context : contexts) {
    for (const Grip& held : context.held) {
      context.state.positions_m[held.particle] = held.target_m;
    }
  }
  return true;
}

LengthSource LengthsOf(const ReferenceCloth& cloth) {
  return cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel;
}

StepPlan PlanOf(const ReferenceCloth& cloth, const ClothParameters& parameters) {
  return PlanStep(*cloth.model, parameters, LengthsOf(cloth), ScalarType::kFloat64);
}

// The parameters of each cloth in its world.
std::vector<ClothParameters> ParametersOf(std::span<const SteppedReference> cloths) {
  std::vector<ClothParameters> parameters;
  for (const SteppedReference& stepped : cloths) parameters.push_back(stepped.cloth->parameters);
  if (cloths.size() == 1) return parameters;
  std::vector<WorldCloth> of_world;
  for (size_t k = 0; k < cloths.size(); ++k) {
    of_world.push_back({cloths[k].cloth->model.get(), &parameters[k], LengthsOf(*cloths[k].cloth)});
  }
  const WorldSettings settings = SettingsOfWorld(of_world, ScalarType::kFloat64);
  for (ClothParameters& its : parameters) its = InWorld(std::move(its), settings);
  return parameters;
}

}  // namespace
}  // namespace reference

using reference::PlanOf;

struct ReferenceStep::UnderWay {
  UnderWay(std::span<const SteppedReference> cloths, std::span<const ClothParameters> parameters,
           const ContactSurface* surface, uint32_t max_iterations, bool is_calmer,
           Interruption* interruption) {
    bool may_cross = false;
    for (size_t k = 0; k < cloths.size(); ++k) {
      const ReferenceCloth& cloth = *cloths[k].cloth;
      const StepPlan plan = PlanOf(cloth, parameters[k]);
      plans.push_back(is_calmer && HasCalmerScheme(plan)
                          ? PlanOf(cloth, WithCalmerScheme(parameters[k]))
                          : plan);
      contexts.emplace_back(cloths[k], parameters[k], plans[k], max_iterations, interruption);
      may_cross |= cloth.may_cross_itself;
    }
    progress.cloths.resize(cloths.size());
    self_contacts.Begin(contexts, surface, may_cross, interruption);
    for (size_t k = 0; k < cloths.size(); ++k) {
      starts_crossing.push_back(self_contacts.StartsCrossing(contexts, k));
    }
  }

  std::deque<StepPlan> plans;  // they stay in place
  reference::StepContexts contexts;
  reference::ReferenceSelfContacts self_contacts;
  std::vector<bool> starts_crossing;
  reference::Progress progress;
};

ReferenceStep::ReferenceStep(std::vector<SteppedReference> cloths,
                             std::shared_ptr<const ContactSurface> surface, uint32_t max_iterations)
    : cloths_(std::move(cloths)),
      surface_(std::move(surface)),
      max_iterations_(max_iterations),
      parameters_(reference::ParametersOf(cloths_)) {}

ReferenceStep::~ReferenceStep() = default;

void ReferenceStep::Begin(bool is_calmer, Interruption* interruption) {
  under_way_ = std::make_unique<UnderWay>(cloths_, parameters_, surface_.get(), max_iterations_,
                                          is_calmer, interruption);
}

std::optional<std::vector<StepReport>> ReferenceStep::Continue(const Pause& pause,
                                                               Interruption* interruption) {
  std::vector<StepReport> reports(cloths_.size());
  if (cloths_[0].cloth->fault != FaultReason::kNone) {
    for (size_t k = 0; k < cloths_.size(); ++k) reports[k].fault = cloths_[k].cloth->fault;
    Measure(MeasureContacts(false, interruption), reports);
    return reports;
  }
  if (under_way_ == nullptr) Begin(false, interruption);
  if (!reference::DoSubsteps(under_way_->contexts, under_way_->self_contacts, under_way_->progress,
                             pause)) {
    return std::nullopt;
  }
  if (!End(reports, interruption)) return Continue(pause, interruption);
  return reports;
}

bool ReferenceStep::End(std::vector<StepReport>& reports, Interruption* interruption) {
  reference::StepContexts& contexts = under_way_->contexts;
  std::vector<StepPlan> plans;
  std::vector<EnergyLimit> limits;
  for (size_t k = 0; k < cloths_.size(); ++k) {
    const ReferenceCloth& cloth = *cloths_[k].cloth;
    plans.push_back(PlanOf(cloth, parameters_[k]));
    limits.push_back(
        EnergyLimitOf(*cloth.model, parameters_[k], reference::LengthsOf(cloth), plans[k]));
  }
  std::optional<EnergyBalance> balance;
  const bool may_be_calmer = !has_gained_energy_ && std::ranges::any_of(plans, HasCalmerScheme);
  has_gained_energy_ |= reference::GainEnergy(contexts, cloths_, limits, may_be_calmer, balance);
  if (has_gained_energy_ && may_be_calmer) {
    Begin(true, interruption);
    return false;
  }
  bool is_good = true;
  for (size_t k = 0; k < cloths_.size(); ++k) {
    StepReport& report = reports[k];
    report = under_way_->progress.cloths[k].report;
    report.warnings = plans[k].known_warnings;
    report.warnings.energy_gained = has_gained_energy_;
    report.energy = balance;
    report.warnings.starts_crossing = under_way_->starts_crossing[k];
    report.warnings.contacts_given_up =
        under_way_->self_contacts.has_given_up() || contexts[k].surface_contacts.has_given_up();
    report.warnings.not_converged = !report.converged;
    report.fault = FindFault(contexts[k].state);
    if (report.fault == FaultReason::kNone) report.fault = contexts[k].bodies.Fault();
    is_good &= report.fault == FaultReason::kNone;
  }
  // The step may be dropped in here: nothing has changed yet.
  const auto contacts = MeasureContacts(is_good, interruption);
  for (size_t k = 0; k < cloths_.size(); ++k) {
    ReferenceCloth& cloth = *cloths_[k].cloth;
    StepReport& report = reports[k];
    if (!is_good && report.fault == FaultReason::kNone) report.fault = FaultReason::kInWorld;
    cloth.fault = report.fault;
    cloth.may_cross_itself =
        under_way_->starts_crossing[k] || under_way_->self_contacts.has_failed();
    if (!is_good) continue;
    const reference::StepContext& context = contexts[k];
    if (cloths_[k].asked.measure) {
      report.measured.max_residual_m = under_way_->progress.cloths[k].residual;
      report.measured.rms_motion_m = RmsMotion(cloth.state, context.state);
    }
    const double time_step_s = cloth.parameters.settings.time_step_s;
    if (context.impulses != nullptr) {
      StepImpulses total = context.impulses->Total(cloth.state, context.state,
                                                   cloth.parameters.gravity_m_per_s2, time_step_s);
      context.bodies.AddImpulses(total.colliders);
      if (total.contacts) context.bodies.AddContacts(*total.contacts);
      report.impulses = std::make_shared<StepImpulses>(std::move(total));
    }
    cloth.state = context.state;  // commit
    for (RigidMotion& motion : cloth.parameters.collider_motions) {
      motion = motion.After(time_step_s);
    }
    if (context.bodies.empty()) continue;
    report.bodies = context.bodies.States();
    for (const BodyState& body : *report.bodies) {
      cloth.parameters.collider_motions[body.collider] = body.motion;
    }
  }
  Measure(contacts, reports);
  return true;
}

std::vector<self_contact::SelfContactMeasures> ReferenceStep::MeasureContacts(
    bool is_good, Interruption* interruption) const {
  const bool is_asked =
      std::ranges::any_of(cloths_, [](const auto& stepped) { return stepped.asked.measure; });
  if (!is_asked || surface_ == nullptr) return {};
  std::vector<reference::MeasuredCloth> measured;
  for (size_t k = 0; k < cloths_.size(); ++k) {
    const ParticleState& state = is_good ? under_way_->contexts[k].state : cloths_[k].cloth->state;
    measured.push_back({&cloths_[k].cloth->parameters, &state, cloths_[k].origin_m});
  }
  return reference::MeasureSelfContacts(*surface_, measured, interruption);
}

void ReferenceStep::Measure(std::span<const self_contact::SelfContactMeasures> contacts,
                            std::vector<StepReport>& reports) const {
  for (size_t k = 0; k < cloths_.size(); ++k) {
    const ReferenceCloth& cloth = *cloths_[k].cloth;
    if (!cloths_[k].asked.measure) continue;
    Measurements& measured = reports[k].measured;
    const double residual_m = measured.max_residual_m;
    const double rms_motion_m = measured.rms_motion_m;
    measured =
        MeasureState(*cloth.model, cloth.parameters, cloth.state, cloth.rest_length_targets_m);
    measured.max_residual_m = residual_m;
    measured.rms_motion_m = rms_motion_m;
    if (!contacts.empty()) Tell(contacts[k], measured);
    if (under_way_ == nullptr) continue;  // only a step has warnings
    reports[k].warnings.strain_beyond_limit =
        measured.max_strain > PlanOf(cloth, parameters_[k]).strain_limit;
  }
}

StepReport StepReferenceCloth(ReferenceCloth& cloth, const AskedOfStep& asked,
                              uint32_t max_iterations) {
  ReferenceStep step({{&cloth, asked}}, cloth.contact_surface, max_iterations);
  return (*step.Continue(Pause::Never()))[0];
}

}  // namespace drape
