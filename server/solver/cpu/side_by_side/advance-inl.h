// The stages that change each particle by itself: predict, tether, integrate, damping. Those of
// free particles stay open (OpenStages) until a stage reads particles, and are then done in one
// visit. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#endif

#include <hwy/base.h>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/flight-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Pin k of each cloth.
ClothParticle& PinAt(const GroupContext& context, size_t k) {
  return context.has_own_pins() ? context.own_pins.pins[k]
                                : context.particles[context.model.pins[k]];
}

// The particles become what the pins of each cloth are.
void PlaceOwnPins(const GroupContext& context) {
  if (!context.has_own_pins()) return;
  for (const auto& [particle, pin, cloths] : context.own_pins.lists->holds) {
    ClothParticle& held = context.particles[particle];
    const ClothParticle& own = context.own_pins.pins[pin];
    held.p = Select(MaskOf(cloths), own.p, held.p);
    held.u = Select(MaskOf(cloths), own.u, held.u);
  }
}

void PredictPins(const GroupContext& context) {
  const FloatSubstep& substep = context.substep;
  for (size_t k = 0; k < context.pin_count(); ++k) {
    ClothParticle& pin = PinAt(context, k);
    const VectorsCloths way = (context.pin_targets[k] - pin.p) / substep.pin_shares;
    pin.u = way * substep.inverse_duration;
    pin.p = pin.p + way * substep.pin_lead;
  }
  PlaceOwnPins(context);
}

void IntegratePins(GroupContext& context) {
  const FloatSubstep& substep = context.substep;
  for (size_t k = 0; k < context.pin_count(); ++k) {
    ClothParticle& pin = PinAt(context, k);
    // At the end of the step a pin is where it was asked to be, to the bit.
    pin.p = substep.pin_shares == 1 ? context.pin_targets[k] : pin.p + pin.u * substep.interval;
  }
  PlaceOwnPins(context);
  if (context.flight.expected == nullptr) return;
  for (const uint32_t pin : context.model.pins) {
    SeeEnd(context.flight, pin, context.particles[pin].p);
  }
}

// The free particles begin the substep (Bender et al. 2009, section 3.1, eq. 2): the velocities
// become u = v + a H/2. With two steps, by the backward differentiation formula of second order:
// the positions become b = p + (p - p')/3, the velocities u = (v + (v - v')/3 + H g) / (1 + c H);
// in the first substep of a step b = p + v h/2 and u = (v + h g) / (1 + c h). With remainders u
// makes up for what rounding takes from b, but not of what rests on a collider.
class Prediction {
 public:
  explicit Prediction(const GroupContext& context)
      : is_two_step_(context.substep.is_two_step),
        has_spring_forces_(context.controls.plan.solver.has_spring_forces),
        half_interval_(context.substep.half_interval),
        accelerations_(context.accelerations),
        previous_(context.previous),
        remainders_(context.cloths_with_remainders != 0 ? context.remainders : nullptr),
        all_have_remainders_(context.all_have_remainders()),
        have_remainders_(MaskOf(context.cloths_with_remainders)),
        quiet_round_offs_(context.has_quiet_particles ? context.quiet_round_offs : nullptr),
        inverse_interval_(context.substep.inverse_interval),
        lead_(context.substep.lead),
        kick_(context.gravity * (is_two_step_ ? context.substep.kick_within : half_interval_)),
        damping_factor_(context.damping_factor) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    if (is_two_step_) {
      if (remainders_ != nullptr) [[unlikely]] {
        PredictWithRemainder(i, p, v);
      } else {
        PredictTwoStep(previous_[i], p, v);
      }
    } else {
      Assign(v, v + (has_spring_forces_ ? accelerations_[i] * half_interval_ : kick_));
    }
  }

 private:
  static constexpr float kThird = 1.0f / 3;

  HWY_INLINE VectorsCloths Mean(const ClothParticle& previous, const VectorsCloths& v) const {
    return damping_factor_ * ((v + (v - previous.u) * kThird) + kick_);
  }
  HWY_INLINE void PredictTwoStep(ClothParticle& previous, VectorsCloths& p,
                                 VectorsCloths& v) const {
    const VectorsCloths base = (p + (p - previous.p) * kThird) + v * lead_;
    const VectorsCloths mean = Mean(previous, v);
    Assign(previous.p, p);
    Assign(previous.u, v);
    Assign(p, base);
    Assign(v, mean);
  }
  HWY_INLINE void PredictWithRemainder(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    ClothParticle& previous = previous_[i];
    ClothRemainders& remainders = remainders_[i];
    const bool may_rest = quiet_round_offs_ != nullptr;
    if (may_rest) DropOfResting(i, remainders.now, remainders.previous);
    const VectorsCloths way = ((p - previous.p) * kThird + v * lead_) +
                              (remainders.now + (remainders.now - remainders.previous) * kThird);
    VectorsCloths base = p + way;
    VectorsCloths rest = way - (base - p);
    if (may_rest) DropOfResting(i, rest);
    const VectorsCloths bare_mean = Mean(previous, v);
    VectorsCloths mean = bare_mean + rest * inverse_interval_;
    if (!all_have_remainders_) {
      const VecCloths zero = SplatCloths(0);
      Assign(rest, Select(have_remainders_, rest, VectorsCloths{zero, zero, zero}));
      Assign(base, Select(have_remainders_, base, (p + (p - previous.p) * kThird) + v * lead_));
      Assign(mean, Select(have_remainders_, mean, bare_mean));
    }
    Assign(remainders.previous, remainders.now);
    Assign(remainders.now, rest);
    Assign(previous.p, p);
    Assign(previous.u, v);
    Assign(p, base);
    Assign(v, mean);
  }
  // Where the particle rests on a collider.
  template <class... Remainders>
  HWY_INLINE void DropOfResting(uint32_t i, Remainders&... remainders) const {
    const VecCloths zero = SplatCloths(0);
    const MaskCloths rests = quiet_round_offs_[i] > zero;
    (Assign(remainders, Select(rests, VectorsCloths{zero, zero, zero}, remainders)), ...);
  }

  const bool is_two_step_;
  const bool has_spring_forces_;
  const float half_interval_;
  const VectorsCloths* const accelerations_;
  ClothParticle* const previous_;
  ClothRemainders* const remainders_;  // null: none
  const bool all_have_remainders_;
  const MaskCloths have_remainders_;
  const VecCloths* const quiet_round_offs_;  // null: nothing rests
  const float inverse_interval_;
  const float lead_;
  const VectorsCloths kick_;
  const VecCloths damping_factor_;
};

// Along the start of the substep: `speed` [m/s] is to be taken off the length, `n_end` is the
// direction at its end.
HWY_NOINLINE VectorsCloths PullAlongStart(const GroupContext& context, VectorsCloths start,
                                          VectorsCloths n_end, VecCloths speed) {
  const auto lines = BlendDirections(start, n_end, context.end_share);
  return (speed / lines.slope) * lines.n;
}

// A particle does not end the substep farther from a pin than the cloth between them is long
// (scene/tethers.h).
template <bool kHasOwnPins>
class TetherPull {
 public:
  explicit TetherPull(const GroupContext& context)
      : context_(context),
        one_model_(kHasOwnPins ? context.own_pins.lists->one_model : &context.model),
        offsets_(one_model_ != nullptr ? one_model_->source->tether_offsets().data()
                                       : context.own_pins.lists->tether_offsets.data()),
        tethers_(one_model_ != nullptr ? one_model_->single_tethers.data() : nullptr),
        own_tethers_(one_model_ != nullptr ? nullptr : context.own_pins.lists->tethers.data()),
        own_lengths_(one_model_ != nullptr ? nullptr : context.own_pins.lists->tether_lengths()) {}
  // Position and velocity of a particle.
  HWY_INLINE void operator()(uint32_t i, const VectorsCloths& p, VectorsCloths& u) const {
    for (uint32_t t = offsets_[i]; t < offsets_[i + 1]; ++t) {
      if (kHasOwnPins && own_tethers_ != nullptr) {
        PullToOwnPin(i, t, p, u);
      } else {
        Pull(i, t, context_.particles[tethers_[t].pin], SplatCloths(tethers_[t].length), p, u);
      }
    }
  }

 private:
  HWY_INLINE void PullToOwnPin(uint32_t i, uint32_t t, const VectorsCloths& p,
                               VectorsCloths& u) const {
    const ClothParticle* const pins = context_.own_pins.pins;
    const OwnTether& tether = own_tethers_[t];
    ClothParticle pin = pins[tether.pin];
    for (uint32_t e = tether.others_begin; e < tether.others_end; ++e) {
      const TetherEnd& end = context_.own_pins.lists->tether_ends[e];
      const MaskCloths cloths = MaskOf(end.cloths);
      Assign(pin.p, Select(cloths, pins[end.pin].p, pin.p));
      Assign(pin.u, Select(cloths, pins[end.pin].u, pin.u));
    }
    Pull(i, t, pin, LoadCloths(own_lengths_ + t * kClothCount), p, u);
  }

  // In the cloths in which the particle is free.
  HWY_NOINLINE void PullPin(uint32_t i, uint32_t t, VectorsCloths change) const {
    if (context_.IsHeldBySome(i)) {
      change = Select(context_.FreeCloths(i), change, GroupImpulses::None());
    }
    context_.given->PullAtTether(t, context_.given->Mass(i) * change);
  }

  HWY_INLINE void Pull(uint32_t i, uint32_t t, const ClothParticle& pin, VecCloths reach,
                       const VectorsCloths& p, VectorsCloths& u) const {
    const VectorsCloths before = u;
    const bool is_taut = Pull(pin, reach, p, u);
    if (is_taut && context_.given != nullptr) PullPin(i, t, before - u);
  }

  // Whether it pulls in any cloth.
  HWY_INLINE bool Pull(const ClothParticle& pin, VecCloths reach, const VectorsCloths& p,
                       VectorsCloths& u) const {
    const VectorsCloths start = p - pin.p;
    const VectorsCloths d = start + (u - pin.u) * context_.substep.interval;
    const VecCloths length_sq = Dot(d, d);
    const MaskCloths is_taut = length_sq > reach * reach;
    if (!IsAnyLaneSet(is_taut)) return false;
    const VecCloths none = SplatCloths(0);
    const VecCloths length = Sqrt(length_sq);
    const VecCloths speed = TetherSpeed(length, reach, context_.substep.inverse_interval);
    if (context_.controls.has_start_directions()) {
      u = u - PullAlongStart(context_, start, Directions(d, length), Select(is_taut, speed, none));
    } else {
      u = u - Select(is_taut, speed / length, none) * d;
    }
    return true;
  }

  const GroupContext& context_;
  const FloatModel* const one_model_;  // null: the cloths have tethers of their own
  const uint32_t* const offsets_;
  const SingleTether* const tethers_;
  const OwnTether* const own_tethers_;
  const float* const own_lengths_;
};

// The free particles end the substep (Bender et al. 2009, section 3.1, eq. 1): p = b + H u; the
// velocities become v = u + a H/2, with two steps they are u.
class Integration {
 public:
  explicit Integration(GroupContext& context)
      : range_(context.range),
        is_held_(context.is_held),
        flight_(context.flight.expected != nullptr ? &context.flight : nullptr),
        watches_(context.reach.WatchesEnds(context.max_iterations)),
        is_two_step_(context.open.ended.is_two_step),
        has_spring_forces_(context.controls.plan.solver.has_spring_forces),
        interval_(context.open.ended.interval),
        inverse_interval_(context.open.ended.inverse_interval),
        remainders_(is_two_step_ && context.cloths_with_remainders != 0 ? context.remainders
                                                                        : nullptr),
        all_have_remainders_(context.all_have_remainders()),
        have_remainders_(MaskOf(context.cloths_with_remainders)),
        half_interval_(context.open.ended.half_interval),
        accelerations_(context.accelerations),
        kick_(context.gravity * half_interval_) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    if (remainders_ != nullptr) [[unlikely]] {
      EndWithRemainder(remainders_[i].now, p, v);
    } else {
      Assign(p, p + v * interval_);
    }
    if (watches_) is_held_ &= Holds(range_, p);
    if (flight_ != nullptr) SeeEnd(*flight_, i, p);
    if (is_two_step_) return;
    Assign(v, v + (has_spring_forces_ ? accelerations_[i] * half_interval_ : kick_));
  }

 private:
  HWY_INLINE void EndWithRemainder(VectorsCloths& remainder, VectorsCloths& p,
                                   VectorsCloths& v) const {
    const VectorsCloths way = v * interval_;
    const VectorsCloths end = p + way;
    Assign(v, v - remainder * inverse_interval_);
    Assign(remainder, way - (end - p));
    if (!all_have_remainders_) {
      const VecCloths zero = SplatCloths(0);
      Assign(remainder, Select(have_remainders_, remainder, VectorsCloths{zero, zero, zero}));
    }
    Assign(p, end);
  }

  const ClothBox& range_;
  MaskCloths& is_held_;
  ClothFlight* const flight_;
  const bool watches_;
  const bool is_two_step_;
  const bool has_spring_forces_;
  const float interval_;
  const float inverse_interval_;
  ClothRemainders* const remainders_;  // null: none
  const bool all_have_remainders_;
  const MaskCloths have_remainders_;
  const float half_interval_;
  const VectorsCloths* const accelerations_;
  const VectorsCloths kick_;
};

// All open stages of one free particle.
template <bool kHasOwnPins>
class ParticleVisit {
 public:
  explicit ParticleVisit(GroupContext& context)
      : context_(context),
        open_(context.open),
        particles_(context.particles),
        held_by_(kHasOwnPins ? context.own_pins.lists->held_by.data() : nullptr),
        integrate_(context),
        predict_(context),
        pull_(context) {}
  // `p`, `v`: its position and velocity.
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    if (kHasOwnPins && held_by_[i] != 0) [[unlikely]] {
      VisitInSome(particles_[i], i);
      Assign(p, particles_[i].p);
      Assign(v, particles_[i].u);
      return;
    }
    VisitInAll(i, p, v);
  }
  HWY_INLINE void operator()(uint32_t i) const {
    ClothParticle& particle = particles_[i];
    VectorsCloths p = particle.p, v = particle.u;
    (*this)(i, p, v);
    Assign(particle.p, p);
    Assign(particle.u, v);
  }

 private:
  HWY_INLINE void VisitInAll(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    if (open_.integrate) integrate_(i, p, v);
    if (open_.damp) Assign(v, open_.damping_factor * v);
    if (open_.predict) predict_(i, p, v);
    if (open_.tether) pull_(i, p, v);
  }
  // The cloths that hold the particle keep it as it is.
  HWY_NOINLINE void VisitInSome(ClothParticle& particle, uint32_t i) const {
    const MaskCloths is_free = context_.FreeCloths(i), was_held = context_.is_held;
    VectorsCloths p = particle.p, v = particle.u;
    VisitInAll(i, p, v);
    Assign(particle.p, Select(is_free, p, particle.p));
    Assign(particle.u, Select(is_free, v, particle.u));
    context_.is_held = was_held & (context_.is_held | AndNot(is_free, was_held));
  }

  GroupContext& context_;
  const OpenStages open_;
  ClothParticle* const particles_;
  const uint32_t* const held_by_;
  const Integration integrate_;
  const Prediction predict_;
  const TetherPull<kHasOwnPins> pull_;
};

// function(visit)
template <class Function>
void WithVisit(GroupContext& context, const Function& function) {
  if (context.has_own_pins()) return function(ParticleVisit<true>(context));
  function(ParticleVisit<false>(context));
}

// To be called before particles are read or changed otherwise.
void Settle(GroupContext& context) {
  if (!context.open.any()) return;
  WithVisit(context, [&](const auto& visit) {
    for (const uint32_t i : context.free_particles) visit(i);
  });
  context.open = {};
}

void Predict(GroupContext& context) {
  PredictPins(context);
  context.open.predict = true;
}

void Tether(GroupContext& context) {
  context.open.tether = context.controls.Has(StepStage::kTether);
}

void Integrate(GroupContext& context) {
  Settle(context);
  NextFlightSubstep(context.flight);
  IntegratePins(context);
  context.open.integrate = true;
  context.open.ended = context.substep;
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
