#include "server/solver/cpu/alone/cloth_step.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/alone/advance_lengths.h"
#include "server/solver/cpu/alone/bodies.h"
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
#include "server/solver/cpu/alone/surface_contacts.h"
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

// Between stages that take long where particles and colliders are many.
void AskInterruption(const StepContext& context) {
  const bool is_large = context.model.particle_count >= kMinTeamParticles;
  if (is_large) Ask(context.interruption);
}

using Part = StepProgress::Part;

// No velocity along rigid links is left (Bender et al. 2009, section 3.2). False: paused.
bool SolveVelocity(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  const auto sweeps_of = [](const SteppedCloth& cloth) {
    return cloth.context.controls.plan.solver.velocity_iterations;
  };
  uint32_t sweeps = 0;
  for (const SteppedCloth& cloth : cloths) sweeps = std::max(sweeps, sweeps_of(cloth));
  while (progress.sweep < sweeps) {
    for (const SteppedCloth& cloth : cloths) {
      if (progress.sweep >= sweeps_of(cloth)) continue;
      SolveDistanceVelocities(cloth.context);
      SolveJointVelocities(cloth.context);
    }
    if (++progress.sweep < sweeps && pause.IsDue()) return false;
  }
  return true;
}

// One sweep over the links and joints of a cloth. Whether it has found an error.
bool SweepLinks(const StepContext& context, uint32_t sweep) {
  const FloatControls& controls = context.controls;
  // All always run: a contact can break what the distances have just met.
  bool has_changed = controls.Has(StepStage::kSolveStrips) && SolveStrips(context);
  if (context.substep.is_last && sweep + 1 == context.max_iterations) RefineLinks(context);
  if (controls.Has(StepStage::kSolveDistance)) has_changed |= SolveDistance(context);
  return has_changed | SolveJoints(context);
}

// Sweeps until none finds an error, at most max_iterations, and some more after hard hits. A cloth
// that has none waits for those of its world, until contacts change something again. False: paused.
bool Solve(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  while (progress.sweep < SweepsAfterHits(cloths)) {
    for (size_t k = 0; k < cloths.size(); ++k) {
      StepOfCloth& its = progress.cloths[k];
      if (!its.is_sweeping) continue;
      ++its.report.iterations;
      its.has_changed = SweepLinks(cloths[k].context, progress.sweep);
    }
    const bool have_contacts_changed = SolveSelfContacts(cloths);
    bool is_over = true;
    for (size_t k = 0; k < cloths.size(); ++k) {
      StepOfCloth& its = progress.cloths[k];
      if (its.is_sweeping) {
        its.has_changed |= SolveBodies(cloths[k].context);
        its.has_changed |= SolveSurfaceContacts(cloths[k].context);
        AskInterruption(cloths[k].context);
        its.has_changed |= SolveContacts(cloths[k].context);
        AskInterruption(cloths[k].context);
      }
      its.is_sweeping = cloths[k].context.controls.tolerance == 0 || have_contacts_changed ||
                        (its.is_sweeping && its.has_changed);
      is_over &= !its.is_sweeping;
    }
    if (is_over) return true;
    if (++progress.sweep < SweepsAfterHits(cloths) && pause.IsDue()) return false;
  }
  for (size_t k = 0; k < cloths.size(); ++k) {
    StepOfCloth& its = progress.cloths[k];
    if (cloths[k].context.controls.tolerance > 0 && its.is_sweeping) its.report.converged = false;
  }
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
  scratch.elastic_impulses.resize(solver.has_elastic_lines
                                      ? model.particle_count
                                      : model.elastic_groups.size() * kVec4Size *
                                            model.source->elastic_shares().impulses_per_element);
  if (context.controls.grid_strengths != nullptr) {
    scratch.grid_elastic.Prepare(model.grid_elements, context.team.max_members());
  }
  if (context.controls.Has(StepStage::kApplyWind)) {
    scratch.air_impulses.resize(model.triangles.size() * kVec4Size);
  }
  const bool has_impulses = model.has_compliance() || model.has_inequalities();
  scratch.distance_impulses.resize(has_impulses ? model.groups.size() + 1 : 0);
  const auto ask = [&context] { AskInterruption(context); };
  ResizeInPieces(scratch.contacts, model.particle_count * scratch.reach.near.size(), ask);
  scratch.clearances.Reset(state.positions.size(), scratch.reach.near.size(), ask);
  if (solver.has_quiet_links) scratch.quiet_round_offs.assign(state.positions.size(), 0);
  scratch.has_quiet_particles = false;
  scratch.self_contacts_failed = false;
  if (ImpulseSums* const sums = context.impulses())
    sums->Begin(model, scratch.reach.near.size(), context.asks_for_contacts);
  BeginBodies(context);
  BeginSurfaceContacts(context);
  AskInterruption(context);
}

void BeforeSweeps(const StepContext& context) {
  Kick(context, context.scratch.state.positions, context.substep.kick_before);
  AskInterruption(context);
  PredictContacts(context);
  AskInterruption(context);
  FindSurfaceContacts(context);
  AskInterruption(context);
  PredictBodies(context);
  AccelerateBySprings(context);
  Predict(context);
  KickWithin(context);
  AdvanceLengths(context);
  SolveElastic(context);
  SolveHinges(context);
  DampTwist(context);
  Tether(context);
}

// One substep, or what is left of it. False: paused.
bool Advance(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  if (progress.part == Part::kBeforeSweeps) {
    for (const SteppedCloth& cloth : cloths) BeforeSweeps(cloth.context);
    FindSelfContacts(cloths);
    for (const SteppedCloth& cloth : cloths) ResetImpulses(cloth.context);
    for (StepOfCloth& its : progress.cloths) its.is_sweeping = true;
    progress.part = Part::kSweeps;
    progress.sweep = 0;
  }
  if (progress.part == Part::kSweeps) {
    if (!Solve(cloths, progress, pause)) return false;
    for (const SteppedCloth& cloth : cloths) {
      IntegrateBodies(cloth.context);
      Integrate(cloth.context);
    }
    GuardSelfContacts(cloths);
    for (const SteppedCloth& cloth : cloths) AdvanceSurfaceContacts(cloth.context);
    progress.part = Part::kVelocitySweeps;
    progress.sweep = 0;
  }
  if (!SolveVelocity(cloths, progress, pause)) return false;
  for (const SteppedCloth& cloth : cloths) {
    CorrectBodies(cloth.context);
    CorrectSurfaceContacts(cloth.context);
    CorrectVelocity(cloth.context);
    Kick(cloth.context, cloth.context.scratch.state.positions, cloth.context.substep.kick_after);
  }
  progress.part = Part::kBeforeSweeps;
  return true;
}

void BeginSubstep(StepContext& context, uint32_t index, double substep_s) {
  PlaceColliders(context, index, substep_s);
  context.scratch.bodies.Begin(index * substep_s, substep_s);
  if (ImpulseSums* const sums = context.impulses()) sums->BeginSubstep(context, index, substep_s);
  if (index == 0 && context.substep.is_two_step) {
    StepScratch& scratch = context.scratch;
    Copy(context, scratch.state, scratch.previous);
    scratch.has_remainders = HasRemainders(context.controls.plan.solver, scratch.state);
    if (!scratch.has_remainders) return;
    const size_t count = scratch.state.positions.size();
    scratch.remainders.assign(count, Vec4{});
    scratch.previous_remainders.assign(count, Vec4{});
  }
}

// The substeps, or those that are left, on copies of the states that they begin with. False:
// paused.
bool DoSubsteps(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  if (!progress.has_begun) {
    progress.cloths.assign(cloths.size(), {});
    for (const SteppedCloth& cloth : cloths) Begin(cloth.context, cloth.state);
    BeginSelfContacts(cloths);
    for (size_t k = 0; k < cloths.size(); ++k) {
      StepWarnings& warnings = progress.cloths[k].report.warnings;
      warnings = cloths[k].context.controls.plan.known_warnings;
      warnings.starts_crossing = StartsCrossing(cloths, k);
    }
    progress.has_begun = true;
  }
  const uint32_t substeps = cloths[0].context.controls.plan.schedule.size();
  while (progress.substep < substeps) {
    for (SteppedCloth& cloth : cloths) {
      const FloatControls& controls = cloth.context.controls;
      const Substep substep = controls.plan.schedule[progress.substep];
      cloth.context.substep = FloatSubstep(substep, controls.damping_per_s);
      if (progress.part == Part::kBeforeSweeps) {
        BeginSubstep(cloth.context, progress.substep, substep.duration_s);
      }
    }
    if (!Advance(cloths, progress, pause)) return false;
    if (++progress.substep < substeps && pause.IsDue()) return false;
  }
  return true;
}

// For the step once more. A cloth without a calmer scheme keeps its own.
StepContext CalmerContext(const StepContext& context) {
  const FloatControls& controls =
      context.calmer_controls != nullptr ? *context.calmer_controls : context.controls;
  StepContext calmer{context.model,
                     controls,
                     context.held,
                     context.own_lengths,
                     context.collider_motions,
                     context.scratch,
                     context.team,
                     context.max_iterations,
                     context.leaves_out_colliders};
  calmer.contact_surface = context.contact_surface;
  calmer.surface_parts = context.surface_parts;
  calmer.world_origin = context.world_origin;
  calmer.may_cross_itself = context.may_cross_itself;
  calmer.asks_for_impulses = context.asks_for_impulses;
  calmer.asks_for_contacts = context.asks_for_contacts;
  calmer.colliders = context.colliders;
  calmer.edges = context.edges;
  calmer.energy = context.energy;
  calmer.interruption = context.interruption;
  return calmer;
}

bool ContinueOnce(SteppedCloths cloths, StepProgress& progress, const Pause& pause);

bool ContinueCalmer(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  std::vector<SteppedCloth> calmer;
  for (const SteppedCloth& cloth : cloths) {
    calmer.push_back({CalmerContext(cloth.context), cloth.measure, cloth.state});
  }
  return ContinueOnce(calmer, progress, pause);
}

// The end of the substeps of all cloths.
Ending End(SteppedCloths cloths, StepProgress& progress) {
  std::vector<EndingCloth> ends;
  std::vector<std::shared_ptr<const StepImpulses>> impulses(cloths.size());
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto& [context, measure, state] = cloths[k];
    const bool may_have_fault = Tidy(context);
    if (const ImpulseSums* const sums = context.impulses()) {
      StepImpulses total = sums->Total(context, state);
      context.scratch.bodies.AddImpulses(total.colliders);
      if (total.contacts) context.scratch.bodies.AddContacts(*total.contacts);
      impulses[k] = std::make_shared<const StepImpulses>(std::move(total));
    }
    ends.push_back({context, state, may_have_fault, measure, progress.cloths[k].report});
  }
  const Ending ending = Finish(ends);
  if (ending != Ending::kDone) return ending;
  for (size_t k = 0; k < cloths.size(); ++k) {
    StepReport& report = progress.cloths[k].report;
    report.warnings.energy_gained |= progress.is_calmer;
    report.warnings.contacts_given_up =
        GaveContactsUp(cloths) || GaveSurfaceContactsUp(cloths[k].context);
    if (report.fault != FaultReason::kNone) continue;
    report.impulses = impulses[k];
    const Bodies& bodies = cloths[k].context.scratch.bodies;
    if (!bodies.empty()) report.bodies = bodies.States();
  }
  return ending;
}

// By the scheme of progress.is_calmer.
bool ContinueOnce(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  for (;;) {
    if (!progress.has_reach) {
      for (const SteppedCloth& cloth : cloths) {
        FindReach(cloth.context, cloth.state, cloth.context.scratch.reach);
      }
    }
    progress.has_reach = true;
    if (!DoSubsteps(cloths, progress, pause)) return false;
    const Ending ending = End(cloths, progress);
    if (ending == Ending::kWithAllColliders) {
      for (const SteppedCloth& cloth : cloths) {
        StepScratch& scratch = cloth.context.scratch;
        if (!scratch.reach.has_left) continue;
        ++scratch.repeats;
        ReachAll(cloth.context, scratch.reach);
      }
      progress = StepProgress{.is_calmer = progress.is_calmer, .has_reach = true};
    } else if (ending == Ending::kCalmer) {
      progress = StepProgress{.is_calmer = true};
      return ContinueCalmer(cloths, progress, pause);
    } else {
      return true;
    }
  }
}

}  // namespace

StepReport StepCalmer(const StepContext& context, bool measure, FloatState& state) {
  StepProgress progress{.is_calmer = true};
  SteppedCloth cloth{context, measure, state};
  ContinueStep({&cloth, 1}, progress, Pause::Never());
  return progress.cloths[0].report;
}

StepReport StepCloth(StepContext context, bool measure, FloatState& state) {
  StepProgress progress;
  SteppedCloth cloth{std::move(context), measure, state};
  ContinueStep({&cloth, 1}, progress, Pause::Never());
  return progress.cloths[0].report;
}

bool ContinueStep(SteppedCloths cloths, StepProgress& progress, const Pause& pause) {
  return progress.is_calmer ? ContinueCalmer(cloths, progress, pause)
                            : ContinueOnce(cloths, progress, pause);
}

}  // namespace drape::cpu
