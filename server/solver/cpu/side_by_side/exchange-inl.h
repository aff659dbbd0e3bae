// States, pin targets and colliders of a group into the lanes, and states back out of them.
// Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_EXCHANGE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_EXCHANGE_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_EXCHANGE_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_EXCHANGE_INL_H_
#endif

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/simd/transpose-inl.h"
#include "server/solver/solver_constants.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

void GatherColliders(std::span<const GroupCloth> cloths, const GroupContext& context) {
  ClothCollider* next = context.colliders;
  for (const uint32_t k : context.reach.near) {
    const auto of = [&](const auto& part) {
      return VectorOf(cloths, [&](const FloatControls& c) { return part(c.colliders[k]); });
    };
    const auto number_of = [&](const auto& part) {
      return NumberOf(cloths, [&](const FloatControls& c) { return part(c.colliders[k]); });
    };
    ClothCollider& collider = *next++;
    collider.kind = context.controls.colliders[k].kind;
    collider.place.point = of([](const FloatCollider& c) { return c.place.point; });
    collider.place.vector = of([](const FloatCollider& c) { return c.place.vector; });
    collider.offset = number_of([](const FloatCollider& c) { return c.offset; });
    collider.size = number_of([](const FloatCollider& c) { return c.size; });
    for (size_t axis = 0; axis < 3; ++axis) {
      collider.place.axes[axis] = of([&](const FloatCollider& c) { return c.place.axes[axis]; });
    }
  }
}

void GatherRanges(std::span<const ColliderReach> reaches, GroupContext& context) {
  const Vec4 *lows[kClothCount], *highs[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const ParticleBox& range = reaches[std::min(lane, reaches.size() - 1)].range;
    lows[lane] = &range.low;
    highs[lane] = &range.high;
  }
  context.range = {LoadVectors(lows, 0), LoadVectors(highs, 0)};
}

void GatherFlights(std::span<const GroupCloth> cloths, GroupScratch& scratch,
                   GroupContext& context) {
  if (!cloths[0].flight) return;
  ClothFlight& flight = context.flight;
  flight.expected = scratch.flight.Reserve<ClothParticle>(context.model.particle_count);
  flight.substep_s = cloths[0].flight->substep_s;
  const Vec4* velocities[kClothCount];
  alignas(64) float drifts[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const ExpectedFlight& its = *cloths[std::min(lane, cloths.size() - 1)].flight;
    velocities[lane] = its.velocities.data();
    drifts[lane] = its.drift;
  }
  flight.drift = LoadCloths(drifts);
  for (size_t i = 0; i < context.model.particle_count; ++i) {
    flight.expected[i] = {context.particles[i].p, LoadVectors(velocities, i)};
  }
}

// States and pin targets into the lanes; lanes without a cloth are like the last one.
void Gather(std::span<const GroupCloth> cloths, const GroupContext& context) {
  const Vec4* positions[kClothCount];
  const Vec4* velocities[kClothCount];
  const Vec4* targets[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const GroupCloth& cloth = cloths[std::min(lane, cloths.size() - 1)];
    positions[lane] = cloth.state.positions.data();
    velocities[lane] = cloth.state.velocities.data();
    targets[lane] = cloth.context.held.targets.data();
  }
  const bool has_previous = context.controls.plan.schedule.has_two_steps();
  for (size_t i = 0; i < context.particle_count(); ++i) {
    const VectorsCloths p = LoadVectors(positions, i), v = LoadVectors(velocities, i);
    context.particles[i] = {p, v};
    if (has_previous) context.previous[i] = {p, v};
  }
  if (context.cloths_with_remainders != 0) {
    const VectorsCloths none{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
    std::fill_n(context.remainders, context.particle_count(), ClothRemainders{none, none});
  }
  if (context.controls.plan.solver.has_quiet_links) {
    std::fill_n(context.quiet_round_offs, context.particle_count(), SplatCloths(0));
  }
  for (size_t k = 0; k < context.pin_count() && !context.has_own_pins(); ++k) {
    context.pin_targets[k] = LoadVectors(targets, k);
  }
}

// The cloths whose particle surely has no fault: a quick look. A velocity is shorter than twice its
// largest component.
HWY_INLINE MaskCloths AreWithin(const VectorsCloths& p, const VectorsCloths& v) {
  const VecCloths max_coordinate = SplatCloths(static_cast<float>(kMaxCoordinate_m));
  const VecCloths max_component = SplatCloths(static_cast<float>(kMaxSpeed_m_per_s / 2));
  return (max_coordinate >= Abs(p.x)) & (max_coordinate >= Abs(p.y)) &
         (max_coordinate >= Abs(p.z)) & (max_component >= Abs(v.x)) & (max_component >= Abs(v.y)) &
         (max_component >= Abs(v.z));
}

// The open stages, and the lanes into one state per cloth, as Tidy leaves it. Returns the cloths of
// which some particle may have a fault, one bit each.
uint32_t Scatter(GroupContext& context, std::span<FloatState> results) {
  std::array<Vec4*, kClothCount> positions{}, velocities{};
  for (size_t lane = 0; lane < results.size(); ++lane) {
    results[lane].positions.resize(context.particle_count());
    results[lane].velocities.resize(context.particle_count());
    positions[lane] = results[lane].positions.data();
    velocities[lane] = results[lane].velocities.data();
  }
  const std::span<Vec4* const> positions_of = std::span(positions).first(results.size());
  const std::span<Vec4* const> velocities_of = std::span(velocities).first(results.size());
  const VectorsCloths zero{SplatCloths(0), SplatCloths(0), SplatCloths(0)};
  MaskCloths are_within = SplatCloths(0) >= SplatCloths(0);
  WithVisit(context, [&](const auto& visit) {
    for (uint32_t i = 0; i < context.particle_count(); ++i) {
      VectorsCloths p = context.particles[i].p, v = context.particles[i].u;
      if (context.IsFree(i)) visit(i, p, v);
      are_within &= AreWithin(p, v);
      StoreVectors(p + zero, positions_of, i);
      StoreVectors(v + zero, velocities_of, i);
    }
  });
  return ~BitsOf(are_within);
}

// Whether each cloth has left its range.
void ScatterReaches(const GroupContext& context, std::span<ColliderReach> reaches) {
  alignas(64) float is_held[kClothCount];
  hn::Store(Select(context.is_held, SplatCloths(1), SplatCloths(0)).v, ClothsTag(), is_held);
  for (size_t lane = 0; lane < reaches.size(); ++lane) reaches[lane].has_left = is_held[lane] == 0;
}

// Writes what Measure reads from the working memory of a cloth.
void ScatterImpulses(const GroupContext& context, size_t lane, StepScratch& scratch) {
  scratch.contacts.resize(context.model.particle_count * context.collider_count());
  for (const uint32_t i : context.free_particles) {
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const size_t place = i * context.collider_count() + k;
      scratch.contacts[place].floor = hn::ExtractLane(context.contacts[place].floor.v, lane);
    }
  }
  scratch.joint_impulses.resize(context.model.joints.size());
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const VectorsCloths& impulse = context.joint_impulses[k];
    scratch.joint_impulses[k] =
        Vec4{hn::ExtractLane(impulse.x.v, lane), hn::ExtractLane(impulse.y.v, lane),
             hn::ExtractLane(impulse.z.v, lane), 0};
  }
  scratch.distance_impulses.resize(context.impulse_count() / kVec4Size);
  for (size_t place = 0; place < context.impulse_count(); ++place) {
    scratch.distance_impulses[place / kVec4Size][place % kVec4Size] =
        hn::ExtractLane(context.distance_impulses[place].v, lane);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
