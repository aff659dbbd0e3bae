#include "server/solver/cpu/alone/cloth_step.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/alone/advance_lengths.h"
#include "server/solver/cpu/alone/contacts.h"
#include "server/solver/cpu/alone/distances.h"
#include "server/solver/cpu/alone/elastic.h"
#include "server/solver/cpu/alone/elastic_lines.h"
#include "server/solver/cpu/alone/grid_elastic.h"
#include "server/solver/cpu/alone/joints.h"
#include "server/solver/cpu/alone/refine_links.h"
#include "server/solver/cpu/alone/self_contacts.h"
#include "server/solver/cpu/alone/springs.h"
#include "server/solver/cpu/alone/strips.h"
#include "server/solver/cpu/alone/tethers.h"
#include "server/solver/cpu/alone/twist.h"
#include "server/solver/cpu/alone/wind.h"
#include "server/solver/cpu/step/find_reach.h"
#include "server/solver/cpu/step/finish.h"

namespace drape::cpu {
namespace {

// Springs, elastic elements and the air act on the velocities for some time.
void Kick(const StepContext& context, const std::vector<Vec4>& positions, float duration) {
  if (duration == 0) return;
  ApplySprings(context, positions.data(), duration);
  ApplyElastic(context, positions.data(), duration);
  ApplyWind(context, positions.data(), duration);
}

// Whether the elements of a grid are all that acts.
bool IsGridElasticAlone(const StepContext& context) {
  const FloatControls& controls = context.controls;
  return controls.grid_strengths != nullptr && !controls.Has(StepStage::kApplySprings) &&
         !controls.Has(StepStage::kApplyWind);
}

// The same on the predicted velocities u, from the predicted positions b + H u.
void KickWithin(const StepContext& context) {
  const FloatControls& controls = context.controls;
  if (context.substep.kick_within == 0) return;
  if (!controls.plan.stages.HasAnyOf(
          {StepStage::kApplySprings, StepStage::kApplyElastic, StepStage::kApplyWind})) {
    return;
  }
  if (IsGridElasticAlone(context)) {
    return ApplyGridElastic(context, nullptr, context.substep.kick_within);
  }
  PredictPositions(context, context.substep.interval);
  Kick(context, context.scratch.predicted, context.substep.kick_within);
}

void ResetImpulses(const StepContext& context) {
  context.scratch.joint_impulses.assign(context.model.joints.size(), Vec4{});
  if (context.controls.Has(StepStage::kSolveStrips) && !context.KeepsImpulses()) return;
  std::vector<Vec4>& impulses = context.scratch.distance_impulses;
  context.ForRanges(impulses.size(), kParticleGrain, [&](size_t begin, size_t end) {
    std::fill_n(impulses.data() + begin, end - begin, Vec4{});
  });
}

using Part = StepProgress::Part;

// No velocity along rigid links is left (Bender et al. 2009, section 3.2). False: paused.
bool SolveVelocity(const StepContext& context, StepProgress& progress, const Pause& pause) {
  const uint32_t sweeps = context.controls.plan.solver.velocity_iterations;
  while (progress.sweep < sweeps) {
    SolveDistanceVelocities(context);
    SolveJointVelocities(context);
    if (++progress.sweep < sweeps && pause.IsDue()) return false;
  }
  return true;
}

// Sweeps until none finds an error, at most max_iterations, and some more after hard hits. False:
// paused.
bool Solve(const StepContext& context, StepProgress& progress, const Pause& pause) {
  const FloatControls& controls = context.controls;
  while (progress.sweep < SweepsAfterHits(context)) {
    ++progress.report.iterations;
    // All always run: a contact can break what the distances have just met.
    bool has_changed = controls.Has(StepStage::kSolveStrips) && SolveStrips(context);
    if (context.substep.is_last && progress.sweep + 1 == context.max_iterations) {
      RefineLinks(context);
    }
    if (controls.Has(StepStage::kSolveDistance)) has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveSelfContacts(context);
    has_changed |= SolveContacts(context);
    if (controls.tolerance > 0 && !has_changed) return true;
    if (++progress.sweep < SweepsAfterHits(context) && pause.IsDue()) return false;
  }
  if (controls.tolerance > 0) progress.report.converged = false;
  return true;
}

// A component of a velocity or position. A zero has no sign: which one it got depends on what
// padding added to it, and so on the path.
void DropSignsOfZeros(Vec4& vector) {
  vector += Vec4{};
}

// The components without which a particle has no fault: a quick look. A velocity is shorter than
// twice its largest component.
Mask4 AreBeyond(Vec4 p, Vec4 v) {
  constexpr auto kMaxCoordinate = static_cast<float>(kMaxCoordinate_m);
  constexpr auto kMaxComponent = static_cast<float>(kMaxSpeed_m_per_s / 2);
  return ~((Abs(p) <= kMaxCoordinate) & (Abs(v) <= kMaxComponent));  // of no number too
}

// Drops the signs of zeros. Whether some particle may have a fault.
bool Tidy(const StepContext& context) {
  FloatState& result = context.scratch.state;
  return context.team.AnyOf(0, result.positions.size(), kParticleGrain,
                            [&](size_t begin, size_t end, uint32_t) {
                              Mask4 are_beyond{};
                              for (size_t i = begin; i < end; ++i) {
                                DropSignsOfZeros(result.positions[i]);
                                DropSignsOfZeros(result.velocities[i]);
                                are_beyond |= AreBeyond(result.positions[i], result.velocities[i]);
                              }
                              return IsAnyLaneSet(are_beyond);
                            });
}

void Copy(const StepContext& context, const FloatState& from, FloatState& to) {
  to.positions.resize(from.positions.size());
  to.velocities.resize(from.velocities.size());
  context.ForRanges(from.positions.size(), kParticleGrain, [&](size_t begin, size_t end) {
    std::copy_n(from.positions.data() + begin, end - begin, to.positions.data() + begin);
    std::copy_n(from.velocities.data() + begin, end - begin, to.velocities.data() + begin);
  });
}

void Begin(const StepContext& context, const FloatState& state) {
  const FloatModel& model = context.model;
  StepScratch& scratch = context.scratch;
  Copy(context, state, scratch.state);
  const SolverChoice& solver = context.controls.plan.solver;
  const bool predicts = solver.has_two_steps || solver.hinge_stages > 0;
  scratch.predicted.resize(predicts ? state.positions.size() : 0);
  scratch.strips.resize(context.team.max_members());
  if (solver.hinge_period > 1) scratch.hinge_changes.resize(state.positions.size());
  scratch.accelerations.resize(model.has_springs() ? model.particle_count : 0);
  scratch.elastic_impulses.resize(
      solver.has_elastic_lines ? model.particle_count : model.elastic_groups.size() * kVec4Size);
  if (context.controls.grid_strengths != nullptr) {
    scratch.grid_elastic.Prepare(model.grid_elements, context.team.max_members());
  }
  if (context.controls.Has(StepStage::kApplyWind)) {
    scratch.air_impulses.resize(model.triangles.size() * kVec4Size);
  }
  const bool has_impulses = model.has_compliance() || model.has_inequalities();
  scratch.distance_impulses.resize(has_impulses ? model.groups.size() + 1 : 0);
  scratch.contacts.resize(model.particle_count * scratch.reach.near.size());
  if (solver.has_quiet_links) scratch.quiet_round_offs.assign(state.positions.size(), 0);
  scratch.has_quiet_particles = false;
  scratch.self_contacts_failed = false;
  if (ImpulseSums* const sums = context.impulses()) sums->Begin(model, scratch.reach.near.size());
}

void BeforeSweeps(const StepContext& context) {
  Kick(context, context.scratch.state.positions, context.substep.kick_before);
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
bool Advance(const StepContext& context, StepProgress& progress, const Pause& pause) {
  if (progress.part == Part::kBeforeSweeps) {
    BeforeSweeps(context);
    progress.part = Part::kSweeps;
    progress.sweep = 0;
  }
  if (progress.part == Part::kSweeps) {
    if (!Solve(context, progress, pause)) return false;
    Integrate(context);
    GuardSelfContacts(context);
    progress.part = Part::kVelocitySweeps;
    progress.sweep = 0;
  }
  if (!SolveVelocity(context, progress, pause)) return false;
  CorrectVelocity(context);
  Kick(context, context.scratch.state.positions, context.substep.kick_after);
  progress.part = Part::kBeforeSweeps;
  return true;
}

// The substeps, or those that are left, on the copy of `state` that they begin with. False: paused.
bool DoSubsteps(StepContext& context, const FloatState& state, StepProgress& progress,
                const Pause& pause) {
  const FloatControls& controls = context.controls;
  if (!progress.has_begun) {
    progress.report.warnings = controls.plan.known_warnings;
    Begin(context, state);
    progress.report.warnings.starts_crossing = BeginSelfContacts(context);
    progress.has_begun = true;
  }
  while (progress.substep < controls.plan.schedule.size()) {
    const Substep substep = controls.plan.schedule[progress.substep];
    context.substep = FloatSubstep(substep, controls.damping_per_s);
    if (progress.part == Part::kBeforeSweeps) {
      PlaceColliders(context, progress.substep, substep.duration_s);
      if (ImpulseSums* const sums = context.impulses()) {
        sums->BeginSubstep(context, progress.substep, substep.duration_s);
      }
      if (progress.substep == 0 && context.substep.is_two_step) {
        Copy(context, context.scratch.state, context.scratch.previous);
      }
    }
    if (!Advance(context, progress, pause)) return false;
    if (++progress.substep < controls.plan.schedule.size() && pause.IsDue()) return false;
  }
  return true;
}

// For the step once more.
StepContext CalmerContext(const StepContext& context) {
  StepContext calmer{context.model,       *context.calmer_controls, context.held,
                     context.own_lengths, context.collider_motions, context.scratch,
                     context.team,        context.max_iterations,   context.leaves_out_colliders};
  calmer.contact_surface = context.contact_surface;
  calmer.may_cross_itself = context.may_cross_itself;
  calmer.asks_for_impulses = context.asks_for_impulses;
  calmer.colliders = context.colliders;
  return calmer;
}

}  // namespace

StepReport StepCalmer(const StepContext& context, bool measure, FloatState& state) {
  StepProgress progress{.is_calmer = true};
  return *ContinueStep(context, measure, state, progress, Pause::Never());
}

StepReport StepCloth(StepContext context, bool measure, FloatState& state) {
  StepProgress progress;
  return *ContinueStep(context, measure, state, progress, Pause::Never());
}

std::optional<StepReport> ContinueStep(StepContext context, bool measure, FloatState& state,
                                       StepProgress& progress, const Pause& pause) {
  ColliderReach& reach = context.scratch.reach;
  if (progress.is_calmer && context.calmer_controls != nullptr) {
    return ContinueStep(CalmerContext(context), measure, state, progress, pause);
  }
  for (;;) {
    if (!progress.has_reach) FindReach(context, state, reach);
    progress.has_reach = true;
    if (!DoSubsteps(context, state, progress, pause)) return std::nullopt;
    const bool may_have_fault = Tidy(context);
    std::shared_ptr<const StepImpulses> impulses;
    if (const ImpulseSums* const sums = context.impulses()) {
      impulses = std::make_shared<const StepImpulses>(sums->Total(context, state));
    }
    const Ending ending = Finish(context, may_have_fault, measure, state, progress.report);
    if (ending == Ending::kWithAllColliders) {
      ++context.scratch.repeats;
      ReachAll(context, reach);
      progress = StepProgress{.is_calmer = progress.is_calmer, .has_reach = true};
    } else if (ending == Ending::kCalmer) {
      progress = StepProgress{.is_calmer = true};
      return ContinueStep(context, measure, state, progress, pause);
    } else {
      progress.report.warnings.energy_gained |= progress.is_calmer;
      if (progress.report.fault == FaultReason::kNone) progress.report.impulses = impulses;
      return progress.report;
    }
  }
}

}  // namespace drape::cpu
