#include "server/solver/cpu/lane_step.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/lane_step.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/lane_contacts-inl.h"
#include "server/solver/cpu/lane_kicks-inl.h"
#include "server/solver/cpu/lane_state-inl.h"
#include "server/solver/cpu/lane_sweeps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

void PredictPins(const LaneContext& context) {
  const FloatSubstep& substep = context.substep;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    ClothParticle& pin = context.particles[context.model.pins[k]];
    const ClothVectors way = (context.pin_targets[k] - pin.p) / substep.pin_shares;
    pin.u = way * substep.inverse_duration;
    pin.p = pin.p + way * substep.pin_lead;
  }
}

// Bender et al. 2009, section 3.1, eq. 2: the velocities become u = v + a H/2.
void PredictBallistic(const LaneContext& context) {
  const FloatModel& model = context.model;
  const float half = context.substep.half_interval;
  const ClothVectors kick = context.gravity * half;
  const auto p = [&](uint32_t i) { return context.particles[i].p; };
  if (context.controls.has_spring_forces) {
    for (const uint32_t i : model.free_particles) {
      context.accelerations[i] = context.gravity + SpringAcceleration(context, p, i);
    }
  }
  for (const uint32_t i : model.free_particles) {
    ClothVectors& v = context.particles[i].u;
    v = v + (context.controls.has_spring_forces ? context.accelerations[i] * half : kick);
  }
}

// The backward differentiation formula of second order: the positions become b = p + (p - p')/3,
// the velocities u = (v + (v - v')/3 + H g) / (1 + c H).
void PredictTwoStep(const LaneContext& context) {
  constexpr float kThird = 1.0f / 3;
  const ClothVectors kick = context.gravity * context.substep.interval;
  const bool sets_previous = context.substep.sets_previous;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& now = context.particles[i];
    ClothParticle& previous = context.previous[i];
    const ClothVectors base = now.p + (now.p - previous.p) * kThird;
    const ClothVectors mean =
        context.damping_factor * ((now.u + (now.u - previous.u) * kThird) + kick);
    if (sets_previous) previous = now;
    now = {base, mean};
  }
}

void Predict(const LaneContext& context) {
  if (context.substep.is_two_step) {
    PredictTwoStep(context);
  } else {
    PredictContacts(context);
    PredictBallistic(context);
  }
  PredictPins(context);
  if (context.substep.is_two_step) KickWithin(context);
  const ClothVectors none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  std::fill_n(context.joint_impulses, context.model.joints.size(), none);
  std::fill_n(context.distance_impulses, context.impulse_count(), SplatCloths(0));
}

// The twist of the cells of one row times the share; one more at each end that is 0.
void StoreTwists(const ClothParticle* upper, const ClothParticle* lower, uint32_t columns,
                 float share, ClothVectors* twists) {
  for (uint32_t column = 0; column + 1 < columns; ++column) {
    twists[column + 1] = SplatCloths(share) * ((upper[column].u - upper[column + 1].u) -
                                               (lower[column].u - lower[column + 1].u));
  }
}

// Every cell of the grid gives its corners a share of its twist back (server/solver/README.md).
void DampTwist(const LaneContext& context) {
  const FloatModel& model = context.model;
  const uint32_t columns = model.source->grid_columns(), rows = model.source->grid_rows();
  const ClothVectors none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  ClothVectors* above = context.twists;  // of the cells above the row of particles
  ClothVectors* below = above + columns + 1;
  std::fill_n(above, 2 * (columns + size_t{1}), none);
  for (uint32_t row = 0; row < rows; ++row) {
    ClothParticle* const particles = context.particles + size_t{row} * columns;
    if (row + 1 < rows) {
      StoreTwists(particles, particles + columns, columns, context.substep.twist_share, below);
    } else {
      std::fill_n(below, columns + 1, none);
    }
    const float* const w = model.inverse_masses.data() + size_t{row} * columns;
    for (uint32_t column = 0; column < columns; ++column) {
      if (w[column] == 0) continue;
      const ClothVectors change =
          (above[column + 1] - above[column]) + (below[column] - below[column + 1]);
      particles[column].u = particles[column].u + change;
    }
    std::swap(above, below);
  }
}

// Along the start of the substep: `speed` [m/s] is to be taken off the length, `n_end` is the
// direction at its end.
ClothVectors PullAlongStart(const LaneContext& context, const ClothVectors& start,
                            const ClothVectors& n_end, ClothLanes speed) {
  const auto lines = BlendDirections(start, n_end, context.end_share);
  return (speed / lines.slope) * lines.n;
}

// No particle ends the substep farther from a pin than the cloth between them is long
// (scene/tethers.h).
void ApplyTethers(const LaneContext& context) {
  const float h = context.substep.interval;
  const ClothLanes none = SplatCloths(0);
  for (const SingleTether& tether : context.model.single_tethers) {
    ClothParticle& particle = context.particles[tether.particle];
    const ClothParticle& pin = context.particles[tether.pin];
    const ClothVectors start = particle.p - pin.p;
    const ClothVectors d = start + (particle.u - pin.u) * h;
    const ClothLanes length_sq = Dot(d, d);
    const ClothMask is_taut = length_sq > SplatCloths(tether.length * tether.length);
    if (!IsAnyLaneSet(is_taut)) continue;
    const ClothLanes length = Sqrt(length_sq);
    const ClothLanes speed =
        TetherSpeed(length, SplatCloths(tether.length), context.substep.inverse_interval);
    particle.u = particle.u - (context.controls.has_start_directions()
                                   ? PullAlongStart(context, start, Directions(d, length),
                                                    Select(is_taut, speed, none))
                                   : Select(is_taut, speed / length, none) * d);
  }
}

// Bender et al. 2009, section 3.1, eq. 1: p = b + H u; the velocities become v = u + a H/2, with
// two steps they are u.
void Integrate(const LaneContext& context) {
  const FloatSubstep& substep = context.substep;
  const ClothVectors kick = context.gravity * substep.half_interval;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& particle = context.particles[i];
    particle.p = particle.p + particle.u * substep.interval;
    if (substep.is_two_step) continue;
    particle.u = particle.u + (context.controls.has_spring_forces
                                   ? context.accelerations[i] * substep.half_interval
                                   : kick);
  }
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    ClothParticle& pin = context.particles[context.model.pins[k]];
    // At the end of the step a pin is where it was asked to be, to the bit.
    pin.p = substep.pin_shares == 1 ? context.pin_targets[k] : pin.p + pin.u * substep.interval;
  }
}

// The substep under way of all cloths, and what differs between them.
void BeginSubstep(const SubstepSchedule& schedule, uint32_t index, std::span<LaneCloth> cloths,
                  LaneContext& context) {
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

void StepGroup(std::span<LaneCloth> cloths, LaneScratch& scratch) {
  LaneContext context(cloths, scratch);
  const FloatControls& controls = context.controls;
  Gather(cloths, context);
  GatherColliders(cloths, context);
  for (LaneCloth& cloth : cloths) cloth.report.warnings = cloth.context.controls.warnings;
  for (uint32_t index = 0; index < controls.schedule.size(); ++index) {
    BeginSubstep(controls.schedule, index, cloths, context);
    // Before the kick, which is part of what two steps continue.
    if (index == 0 && context.substep.sets_previous) {
      std::copy_n(context.particles, context.particle_count(), context.previous);
    }
    Kick(context, context.substep.kick_before);
    Predict(context);
    if (context.substep.twist_share > 0) DampTwist(context);
    if (controls.use_tethers) ApplyTethers(context);
    Solve(context, cloths);
    Integrate(context);
    SolveVelocity(context);
    CorrectVelocity(context);
    Kick(context, context.substep.kick_after);
  }
  if (scratch.results.size() < cloths.size()) scratch.results.resize(cloths.size());
  Scatter(context, std::span(scratch.results).first(cloths.size()));
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    LaneCloth& cloth = cloths[lane];
    FloatState& working = cloth.context.scratch.state;
    std::swap(working, scratch.results[lane]);
    if (cloth.measure) ScatterImpulses(context, lane, cloth.context.scratch);
    Finish(cloth.context, cloth.measure, cloth.state, cloth.report);
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

HWY_EXPORT(StepGroup);
HWY_EXPORT(Support);

LaneSupport SupportedLanes() {
  return HWY_DYNAMIC_DISPATCH(Support)();
}

bool FitsLanes(const FloatModel& model, const FloatControls& controls) {
  const size_t particles = model.particle_count;
  if (particles > kMaxLaneParticles) return false;
  if (particles * controls.colliders.size() > kMaxLaneContacts) return false;
  const auto is_map = [](const FloatCollider& collider) {
    return collider.kind == FloatCollider::Kind::kDistanceMap;
  };
  return std::none_of(controls.colliders.begin(), controls.colliders.end(), is_map);
}

void StepCloths(std::span<LaneCloth> cloths, LaneScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(StepGroup)(cloths, scratch);
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
