#include "server/solver/cpu/alone/cloth_step.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/alone/advance_lengths.h"
#include "server/solver/cpu/alone/contacts.h"
#include "server/solver/cpu/alone/distances.h"
#include "server/solver/cpu/alone/elastic.h"
#include "server/solver/cpu/alone/elastic_lines.h"
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

// The same on the predicted velocities u, from the predicted positions b + H u.
void KickWithin(const StepContext& context) {
  const FloatControls& controls = context.controls;
  if (context.substep.kick_within == 0) return;
  if (!controls.plan.stages.HasAnyOf(
          {StepStage::kApplySprings, StepStage::kApplyElastic, StepStage::kApplyWind})) {
    return;
  }
  PredictPositions(context);
  Kick(context, context.scratch.predicted, context.substep.kick_within);
}

void ResetImpulses(const StepContext& context) {
  std::vector<Vec4>& impulses = context.scratch.distance_impulses;
  context.ForRanges(impulses.size(), kParticleGrain, [&](size_t begin, size_t end) {
    std::fill_n(impulses.data() + begin, end - begin, Vec4{});
  });
  context.scratch.joint_impulses.assign(context.model.joints.size(), Vec4{});
}

// No velocity along rigid links is left (Bender et al. 2009, section 3.2).
void SolveVelocity(const StepContext& context) {
  for (uint32_t sweep = 0; sweep < context.controls.plan.solver.velocity_iterations; ++sweep) {
    SolveDistanceVelocities(context);
    SolveJointVelocities(context);
  }
}

// Sweeps until none finds an error, at most max_iterations.
void Solve(const StepContext& context, StepReport& report) {
  const FloatControls& controls = context.controls;
  for (uint32_t iteration = 0; iteration < context.max_iterations; ++iteration) {
    ++report.iterations;
    // All always run: a contact can break what the distances have just met.
    bool has_changed = controls.Has(StepStage::kSolveStrips) && SolveStrips(context);
    if (context.substep.is_last && iteration + 1 == context.max_iterations) RefineLinks(context);
    if (controls.Has(StepStage::kSolveDistance)) has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveSelfContacts(context);
    has_changed |= SolveContacts(context);
    if (controls.tolerance > 0 && !has_changed) return;
  }
  if (controls.tolerance > 0) report.converged = false;
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
  scratch.accelerations.resize(model.has_springs() ? model.particle_count : 0);
  scratch.elastic_impulses.resize(
      solver.has_elastic_lines ? model.particle_count : model.elastic_groups.size() * kVec4Size);
  if (context.controls.Has(StepStage::kApplyWind)) {
    scratch.air_impulses.resize(model.triangles.size() * kVec4Size);
  }
  const bool has_impulses = model.has_compliance() || model.has_inequalities();
  scratch.distance_impulses.resize(has_impulses ? model.groups.size() + 1 : 0);
  scratch.contacts.resize(model.particle_count * scratch.reach.near.size());
  if (solver.has_quiet_links) scratch.quiet_round_offs.assign(state.positions.size(), 0);
  scratch.has_quiet_particles = false;
  scratch.self_contacts_failed = false;
}

// One substep.
void Advance(const StepContext& context, StepReport& report) {
  const std::vector<Vec4>& positions = context.scratch.state.positions;
  Kick(context, positions, context.substep.kick_before);
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
  Solve(context, report);
  Integrate(context);
  GuardSelfContacts(context);
  SolveVelocity(context);
  CorrectVelocity(context);
  Kick(context, positions, context.substep.kick_after);
}

// The substeps, on the copy of `state` that they begin with.
StepReport DoSubsteps(StepContext& context, const FloatState& state) {
  const FloatControls& controls = context.controls;
  StepReport report;
  report.warnings = controls.plan.known_warnings;
  Begin(context, state);
  report.warnings.starts_crossing = BeginSelfContacts(context);
  for (uint32_t index = 0; index < controls.plan.schedule.size(); ++index) {
    const Substep substep = controls.plan.schedule[index];
    context.substep = FloatSubstep(substep, controls.damping_per_s);
    PlaceColliders(context, index, substep.duration_s);
    if (index == 0 && context.substep.is_two_step) {
      Copy(context, context.scratch.state, context.scratch.previous);
    }
    Advance(context, report);
  }
  return report;
}

}  // namespace

StepReport StepCloth(StepContext context, bool measure, FloatState& state) {
  ColliderReach& reach = context.scratch.reach;
  FindReach(context, state, reach);
  StepReport report = DoSubsteps(context, state);
  if (Finish(context, Tidy(context), measure, state, report)) return report;
  ++context.scratch.repeats;
  ReachAll(context, reach);
  report = DoSubsteps(context, state);
  Finish(context, Tidy(context), measure, state, report);
  return report;
}

}  // namespace drape::cpu
