#include "server/solver/cpu/side_by_side/group_step.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/side_by_side/group_step.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/contacts-inl.h"
#include "server/solver/cpu/side_by_side/elastic_lines-inl.h"
#include "server/solver/cpu/side_by_side/exchange-inl.h"
#include "server/solver/cpu/side_by_side/flight-inl.h"
#include "server/solver/cpu/side_by_side/kicks-inl.h"
#include "server/solver/cpu/side_by_side/own_elements-inl.h"
#include "server/solver/cpu/side_by_side/own_pins-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/side_by_side/surfaces-inl.h"
#include "server/solver/cpu/side_by_side/sweeps-inl.h"
#include "server/solver/cpu/side_by_side/twist-inl.h"
#include "server/solver/cpu/step/find_reach.h"
#include "server/solver/cpu/step/finish.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

void ResetImpulses(const GroupContext& context) {
  const VectorsCloths none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  std::fill_n(context.joint_impulses, context.model.joints.size(), none);
  if (context.controls.Has(StepStage::kSolveStrips) && !context.KeepsImpulses()) return;
  std::fill_n(context.distance_impulses, context.impulse_count(), SplatCloths(0));
}

// The substep under way of all cloths, and what differs between them.
void BeginSubstep(const SubstepSchedule& schedule, uint32_t index, std::span<GroupCloth> cloths,
                  GroupContext& context) {
  alignas(64) float factors[kClothCount];
  std::fill_n(factors, kClothCount, 1.0f);
  context.has_damping = false;
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    StepContext& cloth = cloths[lane].context;
    cloth.substep = FloatSubstep(schedule[index], cloth.controls.damping_per_s);
    factors[lane] = cloth.substep.damping_factor;
    context.has_damping |= factors[lane] != 1;
  }
  context.damping_factor = LoadCloths(factors);
  context.substep = cloths[0].context.substep;
}

// One substep.
void Advance(GroupContext& context, std::span<GroupCloth> cloths) {
  Kick(context, context.substep.kick_before);
  PredictContacts(context);
  AccelerateBySprings(context);
  Predict(context);
  KickWithin(context);
  SolveElastic(context);
  SolveHinges(context);
  DampTwist(context);
  Tether(context);
  ResetImpulses(context);
  Solve(context, cloths);
  Integrate(context);
  SolveVelocity(context);
  CorrectVelocity(context);
  Kick(context, context.substep.kick_after);
}

void StepSideBySide(std::span<GroupCloth> cloths, GroupScratch& scratch) {
  ListPins(cloths, scratch.pin_lists);
  GroupContext context(cloths, scratch);
  const FloatControls& controls = context.controls;
  Gather(cloths, context);
  GatherFlights(cloths, scratch, context);
  GatherOwnPins(cloths, context);
  GatherOwnElements(cloths, scratch, context);
  GatherColliders(cloths, context);
  std::optional<GroupImpulses> impulses;
  if (DoesAnyAsk(cloths)) {
    impulses.emplace(context.model, context.own_pins.lists, scratch);
    context.given = &*impulses;
  }
  const std::span reaches = std::span(scratch.reaches).first(cloths.size());
  GatherRanges(reaches, context);
  for (GroupCloth& cloth : cloths)
    cloth.report.warnings = cloth.context.controls.plan.known_warnings;
  for (uint32_t index = 0; index < controls.plan.schedule.size(); ++index) {
    BeginSubstep(controls.plan.schedule, index, cloths, context);
    PlaceColliders(cloths, context, index, controls.plan.schedule[index].duration_s,
                   scratch.surfaces);
    if (impulses) {
      impulses->BeginSubstep(cloths, index, controls.plan.schedule[index].duration_s);
    }
    Advance(context, cloths);
  }
  if (scratch.results.size() < cloths.size()) scratch.results.resize(cloths.size());
  const uint32_t may_have_fault = Scatter(context, std::span(scratch.results).first(cloths.size()));
  JudgeFlight(context.flight);
  const uint32_t have_left_flight =
      context.flight.expected != nullptr ? may_have_fault | ~BitsOf(context.flight.is_kept) : 0;
  if (context.reach.has_far) ScatterReaches(context, reaches);
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    GroupCloth& cloth = cloths[lane];
    cloth.must_be_alone = (have_left_flight >> lane & 1) != 0;
    if (cloth.must_be_alone) continue;
    FloatState& working = cloth.context.scratch.state;
    std::swap(working, scratch.results[lane]);
    if (cloth.measure) ScatterImpulses(context, lane, cloth.context.scratch);
    ColliderReach& reach = cloth.context.scratch.reach;
    std::swap(reach, scratch.reaches[lane]);
    const bool is_suspect = (may_have_fault >> lane & 1) != 0;
    std::shared_ptr<const StepImpulses> given;
    if (cloth.context.asks_for_impulses) {
      given = std::make_shared<const StepImpulses>(impulses->Total(lane, cloth));
    }
    const EndingCloth end{cloth.context, cloth.state, is_suspect, cloth.measure, cloth.report};
    const Ending ending = Finish({&end, 1});
    if (ending == Ending::kWithAllColliders) scratch.unfinished.push_back(lane);
    cloth.has_gained_energy = ending == Ending::kCalmer;
    if (cloth.report.fault == FaultReason::kNone) cloth.report.impulses = given;
    std::swap(reach, scratch.reaches[lane]);
    std::swap(working, scratch.results[lane]);
  }
}

LaneSupport Support() {
  const bool is_emulated = HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR;
  return {is_emulated ? 1 : kClothCount, hwy::TargetName(HWY_TARGET)};
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(StepSideBySide);
HWY_EXPORT(Support);

namespace {

// Finds the near colliders of a group: those that any of its cloths can meet.
void FindReaches(std::span<const GroupCloth> cloths, std::vector<ColliderReach>& reaches) {
  const size_t count = cloths[0].context.controls.colliders.size();
  reaches.resize(std::max(reaches.size(), cloths.size()));
  std::vector<uint32_t>& near = reaches[0].near;
  near.clear();
  for (size_t lane = 0; lane < cloths.size() && near.size() < count; ++lane) {
    reaches[lane].range = AddNear(cloths[lane].context, cloths[lane].state, near);
  }
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    reaches[lane].near = near;
    reaches[lane].has_far = near.size() < count;
    reaches[lane].has_left = false;
  }
}

}  // namespace

LaneSupport SupportedLanes() {
  return HWY_DYNAMIC_DISPATCH(Support)();
}

bool FitsLanes(const FloatModel& model, const FloatControls& controls) {
  const size_t particles = model.particle_count;
  if (particles > kMaxLaneParticles) return false;
  if (controls.has_bodies) return false;
  if (particles * controls.colliders.size() > kMaxLaneContacts) return false;
  const auto is_map = [](const FloatCollider& collider) {
    return collider.kind == ShapeKind::kDistanceMap;
  };
  return std::none_of(controls.colliders.begin(), controls.colliders.end(), is_map);
}

void StepCloths(std::span<GroupCloth> cloths, GroupScratch& scratch) {
  FindReaches(cloths, scratch.reaches);
  scratch.unfinished.clear();
  HWY_DYNAMIC_DISPATCH(StepSideBySide)(cloths, scratch);
  if (scratch.unfinished.empty()) return;
  const std::vector<size_t> lanes = std::exchange(scratch.unfinished, {});
  std::vector<GroupCloth> again;
  std::vector<size_t> repeated;
  for (const size_t lane : lanes) {
    // In lanes its edges would not touch what was out of reach.
    cloths[lane].must_be_alone = HasCollidersForEdges(cloths[lane].context);
    if (cloths[lane].must_be_alone) continue;
    repeated.push_back(lane);
    again.push_back(
        {cloths[lane].context, cloths[lane].measure, cloths[lane].state, cloths[lane].flight});
    ReachAll(again.back().context, scratch.reaches[again.size() - 1]);
  }
  scratch.repeats += repeated.size();
  if (again.empty()) return;
  HWY_DYNAMIC_DISPATCH(StepSideBySide)(again, scratch);
  for (size_t k = 0; k < repeated.size(); ++k) {
    cloths[repeated[k]].report = again[k].report;
    cloths[repeated[k]].has_gained_energy = again[k].has_gained_energy;
    cloths[repeated[k]].must_be_alone = again[k].must_be_alone;
  }
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
