#include "server/solver/cpu/alone/contacts.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/contacts.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/alone/particle_block-inl.h"

#ifndef DRAPE_CPU_ALONE_CONTACTS_OUTCOME_
#define DRAPE_CPU_ALONE_CONTACTS_OUTCOME_
namespace drape::cpu {
namespace {

// What a sweep finds, by any of the threads that share the particles.
struct Outcome {
  void AddTo(StepScratch& scratch) const {
    scratch.reach.has_left |= has_left;
    scratch.something_holds |= something_holds;
  }

  std::atomic<bool> has_left = false;         // a particle has left the range
  std::atomic<bool> something_holds = false;  // some contact, by friction
};

}  // namespace
}  // namespace drape::cpu
#endif

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// The near colliders, of one type or the other.
class RestingList {
 public:
  explicit RestingList(const StepContext& context) : context_(context) {}
  size_t size() const { return context_.scratch.reach.near.size(); }
  RestingOfCloth operator[](size_t k) const {
    return {context_.scratch.lane_colliders.Get<ClothCollider>()[k],
            context_.controls.colliders[context_.scratch.reach.near[k]]};
  }

 private:
  const StepContext& context_;
};
class MovingList {
 public:
  explicit MovingList(const StepContext& context) : context_(context) {}
  size_t size() const { return context_.scratch.reach.near.size(); }
  MovingOfCloth operator[](size_t k) const {
    return {context_.scratch.lane_colliders.Get<ClothCollider>()[k],
            context_.controls.colliders[context_.scratch.reach.near[k]],
            context_.scratch.lane_motions.Get<ClothMotion>()[k], context_.scratch.surfaces[k]};
  }

 private:
  const StepContext& context_;
};

// function(surfaces)
template <class Function>
auto WithSurfaces(const StepContext& context, const Function& function) {
  if (context.collider_motions.empty()) return function(RestingList(context));
  return function(MovingList(context));
}

void SpreadColliders(const StepContext& context, uint32_t index, float substep_s) {
  StepScratch& scratch = context.scratch;
  const std::vector<uint32_t>& near = scratch.reach.near;
  const auto described = [&](size_t k) -> const FloatCollider& {
    return context.controls.colliders[near[k]];
  };
  if (index == 0) {
    auto* const colliders = scratch.lane_colliders.Reserve<ClothCollider>(near.size());
    for (size_t k = 0; k < near.size(); ++k) colliders[k] = InAllLanes(described(k));
  }
  if (scratch.surfaces.empty()) return;
  auto* const motions = scratch.lane_motions.Reserve<ClothMotion>(near.size());
  for (size_t k = 0; k < near.size(); ++k) {
    motions[k] = InAllLanes(scratch.surfaces[k], substep_s);
  }
}

ContactNumbers NumbersOf(const StepContext& context) {
  const FloatControls& controls = context.controls;
  const ContactCloths cloth(SplatVectors(controls.gravity),
                            [&](auto member) { return SplatCloths(controls.*member); });
  return {cloth, controls, context.substep};
}

MaskCloths AllLanes() {
  return SplatCloths(0) >= SplatCloths(0);
}

// The particles that may touch one of `count` surfaces: those that are not clear of all.
template <class AreClear>
HWY_INLINE MaskCloths MayTouch(const ParticleBlock& block, size_t count,
                               const AreClear& are_clear) {
  MaskCloths clear_of_all = AllLanes();
  for (size_t k = 0; k < count; ++k) clear_of_all &= are_clear(k);
  return AndNot(clear_of_all, block.lanes());
}

// From positions and velocities before the substep. Returns whether a particle has quiet links.
template <class Surfaces>
bool PredictContactsOf(const StepContext& context, const Surfaces& surfaces,
                       std::span<const uint32_t> particles) {
  StepScratch& scratch = context.scratch;
  const ContactNumbers numbers = NumbersOf(context);
  if (numbers.has_quiet_links) {
    for (const uint32_t i : particles) scratch.quiet_round_offs[i] = 0;
  }
  bool has_quiet_particles = false;
  const auto may_touch = [&](const ParticleBlock& block) {
    // The speed of a rebound is that when the substep starts.
    if (numbers.has_restitution) return block.lanes();
    const VectorsCloths p = block.Load(scratch.state.positions);
    return MayTouch(block, surfaces.size(), [&](size_t k) {
      return surfaces[k].IsClearAtStart(block.LoadClearance(scratch.clearances, k), p);
    });
  };
  ForBlocks(particles, may_touch, [&](const ParticleBlock& block) {
    const VectorsCloths p = block.Load(scratch.state.positions);
    const VectorsCloths v = block.Load(scratch.state.velocities);
    VecCloths quiet_round_off = SplatCloths(0);
    for (size_t k = 0; k < surfaces.size(); ++k) {
      ClothContact contact;
      const VecCloths gap = PredictContact(numbers, surfaces[k], p, v, contact, quiet_round_off);
      block.StoreContact(contact, scratch.contacts, surfaces.size(), k);
      block.StoreClearance(surfaces[k].ClearanceAtStart(p, gap), scratch.clearances, k);
    }
    if (!numbers.has_quiet_links) return;
    alignas(64) float round_offs[kClothCount];
    hn::Store(quiet_round_off.v, ClothsTag(), round_offs);
    ForLanes(block.lanes() & (quiet_round_off > SplatCloths(0)), [&](uint32_t lane) {
      scratch.quiet_round_offs[block.particle(lane)] = round_offs[lane];
      has_quiet_particles = true;
    });
  });
  return has_quiet_particles;
}

template <class Surfaces>
void FindContactFloorsOf(const StepContext& context, const Surfaces& surfaces,
                         std::span<const uint32_t> particles) {
  StepScratch& scratch = context.scratch;
  const size_t count = surfaces.size();
  const auto are_clear = [&](const ParticleBlock& block, size_t k, const VectorsCloths& p) {
    return surfaces[k].IsClearAtStart(block.LoadClearance(scratch.clearances, k), p);
  };
  const auto may_touch = [&](const ParticleBlock& block) {
    return MayTouch(block, count, [&](size_t k) {
      return are_clear(block, k, block.Load(scratch.state.positions));
    });
  };
  ForBlocks(particles, may_touch, [&](const ParticleBlock& block) {
    const VectorsCloths p = block.Load(scratch.state.positions);
    for (size_t k = 0; k < count; ++k) {
      const MaskCloths lanes = AndNot(are_clear(block, k, p), block.lanes());
      if (!IsAnyLaneSet(lanes)) continue;
      ClothContact contact = block.LoadContact(scratch.contacts, count, k);
      contact.floor =
          ContactFloor(surfaces[k].GapAtStart(p).gap, context.controls.depenetration_distance);
      block.StoreContact(contact, scratch.contacts, count, k);
      ForLanes(lanes, [&](uint32_t lane) { scratch.clearances.Forget(k, block.particle(lane)); });
    }
  });
}

// With two steps.
ParticlesBefore Before(const StepContext& context, const ParticleBlock& block) {
  const FloatState& previous = context.scratch.previous;
  return {block.Load(previous.positions), block.Load(previous.velocities)};
}

// Returns whether a contact changed.
template <bool kAsks, class Surfaces>
bool SolveContactsOf(const StepContext& context, const Surfaces& surfaces,
                     std::span<const uint32_t> particles, Outcome& outcome) {
  StepScratch& scratch = context.scratch;
  const size_t count = surfaces.size();
  const ContactNumbers numbers = NumbersOf(context);
  const bool watches = scratch.reach.WatchesSweeps(context.max_iterations);
  const ClothBox range = {SplatVectors(scratch.reach.range.low),
                          SplatVectors(scratch.reach.range.high)};
  const auto are_clear = [&](const ParticleBlock& block, size_t k, const VectorsCloths& place) {
    return surfaces[k].IsClearAtEnd(block.LoadClearance(scratch.clearances, k), place);
  };
  MaskCloths have_left{};
  const auto watch = [&](const ParticleBlock& block, const VectorsCloths& place) {
    if (watches) have_left |= AndNot(Holds(range, place), block.lanes());
  };
  const auto may_touch = [&](const ParticleBlock& block) {
    const VectorsCloths place = block.Load(scratch.state.positions) +
                                block.Load(scratch.state.velocities) * numbers.interval;
    watch(block, place);
    return MayTouch(block, count, [&](size_t k) { return are_clear(block, k, place); });
  };
  MaskCloths changed{}, something_holds{};
  ForBlocks(particles, may_touch, [&](const ParticleBlock& block) {
    const VectorsCloths b = block.Load(scratch.state.positions);
    VectorsCloths u = block.Load(scratch.state.velocities);
    bool has_new_velocity = false;
    for (size_t k = 0; k < count; ++k) {
      const VectorsCloths before = u, place = b + u * numbers.interval;
      const MaskCloths lanes = AndNot(are_clear(block, k, place), block.lanes());
      if (!IsAnyLaneSet(lanes)) continue;
      ClothContact contact = block.LoadContact(scratch.contacts, count, k);
      changed |= SolveContact(
          numbers, surfaces[k], [&] { return Before(context, block); }, lanes, b, contact, u,
          something_holds,
          [&] {
            has_new_velocity = true;
            block.StoreContact(contact, scratch.contacts, count, k);
            const VecCloths zero = SplatCloths(0);
            const MaskCloths has_impulse =
                (contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero);
            ForLanes(lanes & has_impulse,
                     [&](uint32_t lane) { scratch.clearances.Forget(k, block.particle(lane)); });
            watch(block, b + u * numbers.interval);
            if constexpr (kAsks) {
              const LaneVectors changes(u - before), places(place);
              ForLanes(lanes, [&](uint32_t lane) {
                const uint32_t i = block.particle(lane);
                context.impulses()->Push(i, k, context.model.free_masses[i] * changes.values[lane],
                                         places.values[lane]);
              });
            }
          });
    }
    if (has_new_velocity) block.Store(u, scratch.state.velocities);
  });
  if (IsAnyLaneSet(have_left)) outcome.has_left = true;
  if (IsAnyLaneSet(something_holds)) outcome.something_holds = true;
  return IsAnyLaneSet(changed);
}

// Whether some contact has given the particle an impulse in the substep.
HWY_INLINE bool IsPushed(StepScratch& scratch, size_t count, uint32_t i) {
  for (size_t k = 0; k < count; ++k) {
    const bool is_clear = scratch.clearances.Row(k, Clearances::kWay)[i] > 0;
    if (!is_clear && scratch.contacts[i * count + k].normal > 0) return true;
  }
  return false;
}

// A difference over two steps remembers the velocity before an impact: particles that have landed
// go on as if they had always flown with the velocity that the impact left.
void ForgetFlight(const StepContext& context, const ParticleBlock& block, MaskCloths have_landed,
                  const size_t (&landed_on)[kClothCount], const ContactNumbers& numbers,
                  const VectorsCloths& p, const VectorsCloths& v) {
  const auto flight = FlightBefore(p, v, numbers.gravity, numbers.h);
  const LaneVectors positions(flight.position), velocities(flight.velocity);
  FloatState& previous = context.scratch.previous;
  ForLanes(have_landed, [&](uint32_t lane) {
    const uint32_t i = block.particle(lane);
    if (ImpulseSums* const sums = context.impulses()) {
      const Vec4 change = previous.velocities[i] - velocities.values[lane];
      sums->PushInMemory(i, landed_on[lane], context.model.free_masses[i] * change,
                         context.scratch.state.positions[i]);
    }
    previous.positions[i] = positions.values[lane];
    previous.velocities[i] = velocities.values[lane];
  });
}

template <bool kAsks, class Surfaces>
void CorrectVelocityOf(const StepContext& context, const Surfaces& surfaces,
                       std::span<const uint32_t> particles) {
  StepScratch& scratch = context.scratch;
  const size_t count = surfaces.size();
  const ContactNumbers numbers = NumbersOf(context);
  const MaskCloths something_holds = scratch.something_holds ? AllLanes() : MaskCloths{};
  const auto correct = [&](const ParticleBlock& block) {
    const VectorsCloths p = block.Load(scratch.state.positions);
    VectorsCloths v = block.Load(scratch.state.velocities);
    MaskCloths have_landed{};
    size_t landed_on[kClothCount];  // the first one
    for (size_t k = 0; k < count; ++k) {
      const ClothContact contact = block.LoadContact(scratch.contacts, count, k);
      const MaskCloths has_impulse = block.lanes() & (contact.normal > SplatCloths(0));
      if (!IsAnyLaneSet(has_impulse)) continue;
      const auto surface = surfaces[k];
      StartOfContact start{};
      if (numbers.is_two_step) {
        const ParticlesBefore before = Before(context, block);
        start = StartOf(numbers, surface, before.p, before.v);
        const MaskCloths land_here = AndNot(have_landed, has_impulse & start.has_landed);
        ForLanes(land_here, [&](uint32_t lane) { landed_on[lane] = k; });
        have_landed |= land_here;
      }
      [[maybe_unused]] const VectorsCloths before = v;
      v = CorrectContact(numbers, surface, start, p, contact, has_impulse, something_holds, v);
      if constexpr (kAsks) {
        const LaneVectors changes(v - before);
        ForLanes(has_impulse, [&](uint32_t lane) {
          const uint32_t i = block.particle(lane);
          context.impulses()->Push(i, k, context.model.free_masses[i] * changes.values[lane],
                                   scratch.state.positions[i]);
        });
      }
    }
    block.Store(v, scratch.state.velocities);
    if (IsAnyLaneSet(have_landed)) {
      ForgetFlight(context, block, have_landed, landed_on, numbers, p, v);
    }
  };
  BlockQueue queue(correct);
  for (const uint32_t i : particles) {
    if (IsPushed(scratch, count, i)) queue.Add(i);
  }
  queue.Finish();
  // With two steps damping is in the prediction.
  if (numbers.is_two_step || context.substep.damping_factor == 1) return;
  for (const uint32_t i : particles) scratch.state.velocities[i] *= context.substep.damping_factor;
}

bool Predict(const StepContext& context, std::span<const uint32_t> particles) {
  return WithSurfaces(context,
                      [&](const auto& s) { return PredictContactsOf(context, s, particles); });
}
void FindFloors(const StepContext& context, std::span<const uint32_t> particles) {
  WithSurfaces(context, [&](const auto& s) { FindContactFloorsOf(context, s, particles); });
}
bool Solve(const StepContext& context, std::span<const uint32_t> particles, Outcome& outcome) {
  return WithSurfaces(context, [&](const auto& s) {
    return context.impulses() != nullptr ? SolveContactsOf<true>(context, s, particles, outcome)
                                         : SolveContactsOf<false>(context, s, particles, outcome);
  });
}
void Correct(const StepContext& context, std::span<const uint32_t> particles) {
  WithSurfaces(context, [&](const auto& s) {
    if (context.impulses() != nullptr) {
      CorrectVelocityOf<true>(context, s, particles);
    } else {
      CorrectVelocityOf<false>(context, s, particles);
    }
  });
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(SpreadColliders);
HWY_EXPORT(Predict);
HWY_EXPORT(FindFloors);
HWY_EXPORT(Solve);
HWY_EXPORT(Correct);

namespace {

// StepContext::AnyFreeRange of parts between which the step may be interrupted: among hundreds of
// colliders one of a large cloth takes long.
template <class Function>
bool AnyFreePart(const StepContext& context, const Function& function) {
  constexpr size_t kPairsAtOnce = size_t{1} << 20;
  const size_t colliders = std::max<size_t>(context.scratch.reach.near.size(), 1);
  const size_t at_once = std::max<size_t>(kPairsAtOnce / colliders / kParticleGrain, 1);
  const std::span<const uint32_t> particles = context.held.free_particles;
  bool is_any = false;
  for (size_t begin = 0; begin < particles.size(); begin += at_once * kParticleGrain) {
    if (begin > 0) Ask(context.interruption);
    const size_t end = std::min(begin + at_once * kParticleGrain, particles.size());
    is_any |= context.team.AnyOf(begin, end, kParticleGrain,
                                 [&](size_t from, size_t to, uint32_t) -> bool {
                                   return function(particles.subspan(from, to - from));
                                 });
  }
  return is_any;
}

}  // namespace

void PredictContacts(const StepContext& context) {
  if (context.scratch.reach.near.empty()) return;
  context.scratch.something_holds = false;
  context.scratch.has_quiet_particles =
      AnyFreePart(context, [&](std::span<const uint32_t> particles) {
        return HWY_DYNAMIC_DISPATCH(Predict)(context, particles);
      });
}

void FindContactFloors(const StepContext& context) {
  if (context.substep.is_two_step || context.scratch.reach.near.empty()) return;
  AnyFreePart(context, [&](std::span<const uint32_t> particles) {
    HWY_DYNAMIC_DISPATCH(FindFloors)(context, particles);
    return false;
  });
}

bool SolveContacts(const StepContext& context) {
  ColliderReach& reach = context.scratch.reach;
  if (reach.near.empty() && !reach.WatchesSweeps(context.max_iterations)) return false;
  Outcome outcome;
  const bool has_changed = AnyFreePart(context, [&](std::span<const uint32_t> particles) {
    return HWY_DYNAMIC_DISPATCH(Solve)(context, particles, outcome);
  });
  outcome.AddTo(context.scratch);
  return has_changed;
}

void SolveContactsOfParticle(const StepContext& context, uint32_t particle) {
  Outcome outcome;
  HWY_DYNAMIC_DISPATCH(Solve)(context, {&particle, 1}, outcome);
  outcome.AddTo(context.scratch);
}

void CorrectVelocity(const StepContext& context) {
  const bool damps = !context.substep.is_two_step && context.substep.damping_factor != 1;
  if (context.scratch.reach.near.empty() && !damps) return;
  AnyFreePart(context, [&](std::span<const uint32_t> particles) {
    HWY_DYNAMIC_DISPATCH(Correct)(context, particles);
    return false;
  });
}

void PlaceColliders(const StepContext& context, uint32_t index, double substep_s) {
  std::vector<MovingSurface>& surfaces = context.scratch.surfaces;
  const bool moves = !context.collider_motions.empty();
  if (index == 0 || !moves) surfaces.clear();
  if (moves && index == 0) {
    for (const uint32_t k : context.scratch.reach.near) {
      surfaces.emplace_back(context.controls.colliders[k], context.collider_motions[k], substep_s);
    }
  } else {
    for (MovingSurface& surface : surfaces) surface.Advance();
  }
  HWY_DYNAMIC_DISPATCH(SpreadColliders)(context, index, static_cast<float>(substep_s));
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
