#include "server/solver/cpu/side_by_side/group_step.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/side_by_side/group_step.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/contacts-inl.h"
#include "server/solver/cpu/side_by_side/exchange-inl.h"
#include "server/solver/cpu/side_by_side/kicks-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/side_by_side/sweeps-inl.h"
#include "server/solver/cpu/step/finish.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

template <class Prediction>
void PredictFree(const GroupContext& context) {
  const Prediction predict(context);
  for (const uint32_t i : context.model.free_particles) {
    predict(i, context.particles[i].p, context.particles[i].u);
  }
}

void Predict(const GroupContext& context) {
  if (context.substep.is_two_step) {
    PredictFree<TwoStepPrediction>(context);
  } else {
    PredictContacts(context);
    if (context.controls.has_spring_forces) AccelerateBySprings(context);
    PredictFree<BallisticPrediction>(context);
  }
  PredictPins(context);
  if (context.substep.is_two_step) KickWithin(context);
}

void ResetImpulses(const GroupContext& context) {
  const VectorsCloths none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  std::fill_n(context.joint_impulses, context.model.joints.size(), none);
  std::fill_n(context.distance_impulses, context.impulse_count(), SplatCloths(0));
}

// The twist of the cells of one row times the share; one more at each end that is 0.
void StoreTwists(const ClothParticle* upper, const ClothParticle* lower, uint32_t columns,
                 float share, VectorsCloths* twists) {
  for (uint32_t column = 0; column + 1 < columns; ++column) {
    twists[column + 1] = SplatCloths(share) * ((upper[column].u - upper[column + 1].u) -
                                               (lower[column].u - lower[column + 1].u));
  }
}

// Every cell of the grid gives its corners a share of its twist back (server/solver/method.md).
// `before(i)`: before the velocity of a free particle is read, `after(i)`: when it has changed.
template <class Before, class After>
void DampTwist(const GroupContext& context, const Before& before, const After& after) {
  const FloatModel& model = context.model;
  const uint32_t columns = model.source->grid_columns(), rows = model.source->grid_rows();
  const VectorsCloths none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  VectorsCloths* above = context.twists;  // of the cells above the row of particles
  VectorsCloths* below = above + columns + 1;
  std::fill_n(above, 2 * (columns + size_t{1}), none);
  const auto before_row = [&](uint32_t row) {
    for (uint32_t i = row * columns; i < (row + 1) * columns; ++i) {
      if (model.inverse_masses[i] != 0) before(i);
    }
  };
  before_row(0);
  for (uint32_t row = 0; row < rows; ++row) {
    ClothParticle* const particles = context.particles + size_t{row} * columns;
    if (row + 1 < rows) {
      before_row(row + 1);
      StoreTwists(particles, particles + columns, columns, context.substep.twist_share, below);
    } else {
      std::fill_n(below, columns + 1, none);
    }
    const float* const w = model.inverse_masses.data() + size_t{row} * columns;
    for (uint32_t column = 0; column < columns; ++column) {
      if (w[column] == 0) continue;
      const VectorsCloths change =
          (above[column + 1] - above[column]) + (below[column] - below[column + 1]);
      particles[column].u = particles[column].u + change;
      after(row * columns + column);
    }
    std::swap(above, below);
  }
}

void Integrate(GroupContext& context) {
  const Integration integrate(context);
  for (const uint32_t i : context.model.free_particles) {
    integrate(i, context.particles[i].p, context.particles[i].u);
  }
  IntegratePins(context);
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

// Whether nothing but constraints, gravity and damping acts: then all that happens to a particle
// between two sweeps is a matter of its own and its pins, and done in one visit.
bool HasOneVisit(const GroupContext& context) {
  const FloatControls& controls = context.controls;
  return !controls.has_spring_forces && !controls.has_half_kicks && !controls.has_air_forces &&
         !context.model.has_elastic() && context.collider_count() == 0 &&
         context.model.joints.empty() && controls.solver.velocity_iterations == 0;
}

// A substep stage by stage.
void Advance(GroupContext& context, std::span<GroupCloth> cloths) {
  const auto nothing = [](size_t) {};
  Kick(context, context.substep.kick_before);
  Predict(context);
  if (context.substep.twist_share > 0) DampTwist(context, nothing, nothing);
  if (context.controls.use_tethers) ApplyTethers(context);
  Solve(context, cloths, nothing);
  Integrate(context);
  SolveVelocity(context);
  CorrectVelocity(context);
  Kick(context, context.substep.kick_after);
}

// The same where HasOneVisit: particles are prepared when the first strip needs them, while the
// caches have them. Leaves the free particles as they are at the end of the sweeps; `open` tells
// what is left to do, before and after.
template <class Prediction>
void AdvanceInOneVisit(GroupContext& context, std::span<GroupCloth> cloths,
                       std::optional<Ending>& open) {
  const FloatModel& model = context.model;
  const bool has_twist = context.substep.twist_share > 0,
             has_tethers = context.controls.use_tethers;
  const Preparation<Prediction> prepare(context, open, has_tethers && !has_twist);
  const auto prepare_of_pair = [&](size_t pair) {
    for (uint32_t k = model.pair_particle_offsets[pair]; k < model.pair_particle_offsets[pair + 1];
         ++k) {
      prepare(model.pair_particles[k]);
    }
  };
  PredictPins(context);
  if (has_twist) {
    const TetherPull pull(context);
    DampTwist(context, prepare, [&](uint32_t i) {
      if (has_tethers) pull(i, context.particles[i].p, context.particles[i].u);
    });
    Solve(context, cloths, [](size_t) {});
  } else if (context.controls.solver.has_strips) {
    prepare_of_pair(model.strip_pairs.size());  // those that no strip has
    Solve(context, cloths, prepare_of_pair);
  } else {
    for (const uint32_t i : model.free_particles) prepare(i);
    Solve(context, cloths, [](size_t) {});
  }
  IntegratePins(context);
  open.emplace(context);
}

void StepSideBySide(std::span<GroupCloth> cloths, GroupScratch& scratch) {
  GroupContext context(cloths, scratch);
  const FloatControls& controls = context.controls;
  Gather(cloths, context);
  GatherColliders(cloths, context);
  const std::span reaches = std::span(scratch.reaches).first(cloths.size());
  GatherRanges(reaches, context);
  for (GroupCloth& cloth : cloths) cloth.report.warnings = cloth.context.controls.warnings;
  const bool has_one_visit = HasOneVisit(context);
  std::optional<Ending> open;
  for (uint32_t index = 0; index < controls.schedule.size(); ++index) {
    BeginSubstep(controls.schedule, index, cloths, context);
    ResetImpulses(context);
    if (!has_one_visit) {
      Advance(context, cloths);
    } else if (context.substep.is_two_step) {
      AdvanceInOneVisit<TwoStepPrediction>(context, cloths, open);
    } else {
      AdvanceInOneVisit<BallisticPrediction>(context, cloths, open);
    }
  }
  if (scratch.results.size() < cloths.size()) scratch.results.resize(cloths.size());
  const uint32_t may_have_fault =
      Scatter(context, open, std::span(scratch.results).first(cloths.size()));
  if (context.reach.has_far) ScatterReaches(context, reaches);
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    GroupCloth& cloth = cloths[lane];
    FloatState& working = cloth.context.scratch.state;
    std::swap(working, scratch.results[lane]);
    if (cloth.measure) ScatterImpulses(context, lane, cloth.context.scratch);
    ColliderReach& reach = cloth.context.scratch.reach;
    std::swap(reach, scratch.reaches[lane]);
    const bool is_suspect = (may_have_fault >> lane & 1) != 0;
    if (!Finish(cloth.context, is_suspect, cloth.measure, cloth.state, cloth.report)) {
      scratch.unfinished.push_back(lane);
    }
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

// What the step of a group begins with: a collider is near if it is to any cloth.
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
  scratch.repeats += lanes.size();
  std::vector<GroupCloth> again;
  for (const size_t lane : lanes) {
    again.push_back({cloths[lane].context, cloths[lane].measure, cloths[lane].state});
    ReachAll(again.back().context, scratch.reaches[again.size() - 1]);
  }
  HWY_DYNAMIC_DISPATCH(StepSideBySide)(again, scratch);
  for (size_t k = 0; k < lanes.size(); ++k) cloths[lanes[k]].report = again[k].report;
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
