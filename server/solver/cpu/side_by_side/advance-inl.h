// What a substep does to each particle by itself: predict, tether, integrate; as stages over all
// particles, or one particle after the other. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_ADVANCE_INL_H_
#endif

#include <hwy/base.h>

#include <optional>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

void PredictPins(const GroupContext& context) {
  const FloatSubstep& substep = context.substep;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    ClothParticle& pin = context.particles[context.model.pins[k]];
    const VectorsCloths way = (context.pin_targets[k] - pin.p) / substep.pin_shares;
    pin.u = way * substep.inverse_duration;
    pin.p = pin.p + way * substep.pin_lead;
  }
}

void IntegratePins(const GroupContext& context) {
  const FloatSubstep& substep = context.substep;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    ClothParticle& pin = context.particles[context.model.pins[k]];
    // At the end of the step a pin is where it was asked to be, to the bit.
    pin.p = substep.pin_shares == 1 ? context.pin_targets[k] : pin.p + pin.u * substep.interval;
  }
}

// Bender et al. 2009, section 3.1, eq. 2, of a free particle: the velocities become u = v + a H/2.
class BallisticPrediction {
 public:
  explicit BallisticPrediction(const GroupContext& context)
      : has_spring_forces_(context.controls.has_spring_forces),
        half_interval_(context.substep.half_interval),
        accelerations_(context.accelerations),
        kick_(context.gravity * half_interval_) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths&, VectorsCloths& v) const {
    Assign(v, v + (has_spring_forces_ ? accelerations_[i] * half_interval_ : kick_));
  }

 private:
  const bool has_spring_forces_;
  const float half_interval_;
  const VectorsCloths* const accelerations_;
  const VectorsCloths kick_;
};

// The backward differentiation formula of second order: the positions become b = p + (p - p')/3,
// the velocities u = (v + (v - v')/3 + H g) / (1 + c H).
class TwoStepPrediction {
 public:
  explicit TwoStepPrediction(const GroupContext& context)
      : previous_(context.previous),
        kick_(context.gravity * context.substep.interval),
        damping_factor_(context.damping_factor),
        sets_previous_(context.substep.sets_previous) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    constexpr float kThird = 1.0f / 3;
    ClothParticle& previous = previous_[i];
    const VectorsCloths base = p + (p - previous.p) * kThird;
    const VectorsCloths mean = damping_factor_ * ((v + (v - previous.u) * kThird) + kick_);
    if (sets_previous_) {
      Assign(previous.p, p);
      Assign(previous.u, v);
    }
    Assign(p, base);
    Assign(v, mean);
  }

 private:
  ClothParticle* const previous_;
  const VectorsCloths kick_;
  const VecCloths damping_factor_;
  const bool sets_previous_;
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
class TetherPull {
 public:
  explicit TetherPull(const GroupContext& context)
      : context_(context),
        tethers_(context.model.single_tethers.data()),
        offsets_(context.model.source->tether_offsets().data()) {}
  // Position and velocity of a particle.
  HWY_INLINE void operator()(uint32_t i, const VectorsCloths& p, VectorsCloths& u) const {
    for (uint32_t t = offsets_[i]; t < offsets_[i + 1]; ++t) Pull(tethers_[t], p, u);
  }

 private:
  HWY_INLINE void Pull(const SingleTether& tether, const VectorsCloths& p, VectorsCloths& u) const {
    const ClothParticle& pin = context_.particles[tether.pin];
    const VectorsCloths start = p - pin.p;
    const VectorsCloths d = start + (u - pin.u) * context_.substep.interval;
    const VecCloths length_sq = Dot(d, d);
    const MaskCloths is_taut = length_sq > SplatCloths(tether.length * tether.length);
    if (!IsAnyLaneSet(is_taut)) return;
    const VecCloths none = SplatCloths(0);
    const VecCloths length = Sqrt(length_sq);
    const VecCloths speed =
        TetherSpeed(length, SplatCloths(tether.length), context_.substep.inverse_interval);
    if (context_.controls.has_start_directions()) {
      u = u - PullAlongStart(context_, start, Directions(d, length), Select(is_taut, speed, none));
    } else {
      u = u - Select(is_taut, speed / length, none) * d;
    }
  }

  const GroupContext& context_;
  const SingleTether* const tethers_;
  const uint32_t* const offsets_;
};

void ApplyTethers(const GroupContext& context) {
  const TetherPull pull(context);
  for (const uint32_t i : context.model.free_particles) {
    pull(i, context.particles[i].p, context.particles[i].u);
  }
}

// Bender et al. 2009, section 3.1, eq. 1, of a free particle: p = b + H u; the velocities become
// v = u + a H/2, with two steps they are u.
class Integration {
 public:
  explicit Integration(GroupContext& context)
      : range_(context.range),
        is_held_(context.is_held),
        watches_(context.reach.WatchesEnds(context.max_iterations)),
        is_two_step_(context.substep.is_two_step),
        has_spring_forces_(context.controls.has_spring_forces),
        interval_(context.substep.interval),
        half_interval_(context.substep.half_interval),
        accelerations_(context.accelerations),
        kick_(context.gravity * half_interval_) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    Assign(p, p + v * interval_);
    if (watches_) is_held_ &= Holds(range_, p);
    if (is_two_step_) return;
    Assign(v, v + (has_spring_forces_ ? accelerations_[i] * half_interval_ : kick_));
  }

 private:
  const ClothBox& range_;
  MaskCloths& is_held_;
  const bool watches_;
  const bool is_two_step_;
  const bool has_spring_forces_;
  const float interval_;
  const float half_interval_;
  const VectorsCloths* const accelerations_;
  const VectorsCloths kick_;
};

// What ends a substep for a free particle where nothing but constraints, gravity and damping acts.
class Ending {
 public:
  explicit Ending(GroupContext& context)
      : integrate_(context),
        has_damping_(context.has_damping && !context.substep.is_two_step),
        damping_factor_(context.damping_factor) {}
  HWY_INLINE void operator()(uint32_t i, VectorsCloths& p, VectorsCloths& v) const {
    integrate_(i, p, v);
    if (has_damping_) Assign(v, damping_factor_ * v);
  }

 private:
  const Integration integrate_;
  const bool has_damping_;
  const VecCloths damping_factor_;
};

// All that happens to a free particle between the sweeps of two such substeps, in one visit: what
// is left of the one before (`open`), predict and, if asked for, tether.
template <class Prediction>
class Preparation {
 public:
  Preparation(const GroupContext& context, const std::optional<Ending>& open, bool has_tethers)
      : particles_(context.particles),
        open_(open),
        has_tethers_(has_tethers),
        predict_(context),
        pull_(context) {}
  HWY_INLINE void operator()(uint32_t i) const {
    ClothParticle& particle = particles_[i];
    VectorsCloths p = particle.p, v = particle.u;
    if (open_) (*open_)(i, p, v);
    predict_(i, p, v);
    if (has_tethers_) pull_(i, p, v);
    Assign(particle.p, p);
    Assign(particle.u, v);
  }

 private:
  ClothParticle* const particles_;
  const std::optional<Ending>& open_;
  const bool has_tethers_;
  const Prediction predict_;
  const TetherPull pull_;
};

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
