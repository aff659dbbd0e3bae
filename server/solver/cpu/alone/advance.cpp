#include "server/solver/cpu/alone/advance.h"

#include <span>

namespace drape::cpu {
namespace {

// Bender et al. 2009, section 3.1, eq. 2: the velocities become u = v + a H/2.
class BallisticPrediction {
 public:
  explicit BallisticPrediction(const StepContext& context)
      : accelerations_(context.controls.plan.solver.has_spring_forces
                           ? context.scratch.accelerations.data()
                           : nullptr),
        half_interval_(context.substep.half_interval),
        kick_(context.controls.gravity * half_interval_) {}
  void operator()(uint32_t i, Vec4&, Vec4& v) const {
    v += accelerations_ != nullptr ? accelerations_[i] * half_interval_ : kick_;
  }

 private:
  const Vec4* const accelerations_;
  const float half_interval_;
  const Vec4 kick_;
};

// The backward differentiation formula of second order: the positions become b = p + (p - p')/3,
// the velocities u = (v + (v - v')/3 + H g) / (1 + c H). In the first substep of a step, whose
// previous state is the present one, b = p + v h/2 and u = (v + h g) / (1 + c h).
//
// With remainders: b is off by what rounding takes from it, and u makes up for that within the
// substep, so that b + H u is as if nothing were rounded. What rests on a collider has none:
// friction would have to hold what u makes up for.
template <bool kHasRemainders>
class TwoStepPrediction {
 public:
  explicit TwoStepPrediction(const StepContext& context)
      : previous_positions_(context.scratch.previous.positions.data()),
        previous_velocities_(context.scratch.previous.velocities.data()),
        lead_(context.substep.lead),
        kick_(context.controls.gravity * context.substep.kick_within),
        damping_factor_(context.substep.damping_factor),
        inverse_interval_(context.substep.inverse_interval),
        quiet_round_offs_(context.scratch.has_quiet_particles
                              ? context.scratch.quiet_round_offs.data()
                              : nullptr),
        remainders_(context.scratch.remainders.data()),
        previous_remainders_(context.scratch.previous_remainders.data()) {}
  void operator()(uint32_t i, Vec4& p, Vec4& v) const {
    Vec4& previous_p = previous_positions_[i];
    Vec4& previous_v = previous_velocities_[i];
    Vec4 base;
    Vec4 mean = ((v + (v - previous_v) * kThird) + kick_) * damping_factor_;
    if constexpr (kHasRemainders) {
      const bool rests = quiet_round_offs_ != nullptr && quiet_round_offs_[i] > 0;
      if (rests) remainders_[i] = previous_remainders_[i] = Vec4{};
      const Vec4 remainder = remainders_[i];
      const Vec4 way = ((p - previous_p) * kThird + lead_ * v) +
                       (remainder + (remainder - previous_remainders_[i]) * kThird);
      base = p + way;
      const Vec4 rest = rests ? Vec4{} : way - (base - p);
      previous_remainders_[i] = remainder;
      remainders_[i] = rest;
      mean += inverse_interval_ * rest;
    } else {
      base = (p + (p - previous_p) * kThird) + lead_ * v;
    }
    previous_p = p;
    previous_v = v;
    p = base;
    v = mean;
  }

 private:
  static constexpr float kThird = 1.0f / 3;

  Vec4* const previous_positions_;
  Vec4* const previous_velocities_;
  const float lead_;
  const Vec4 kick_;
  const float damping_factor_;
  const float inverse_interval_;
  const float* const quiet_round_offs_;  // null: nothing rests
  Vec4* const remainders_;
  Vec4* const previous_remainders_;
};

template <class Prediction>
void PredictFree(const StepContext& context) {
  Vec4* const p = context.scratch.state.positions.data();
  Vec4* const v = context.scratch.state.velocities.data();
  const Prediction predict(context);
  context.ForFreeParticles([=](uint32_t i) { predict(i, p[i], v[i]); });
}

// Watches where particles end a substep.
ReachWatch WatchOfEnds(const StepContext& context) {
  const ColliderReach& reach = context.scratch.reach;
  return {reach.range, reach.WatchesEnds(context.max_iterations)};
}

// function(i, p, v) ends the substep of a free particle and returns its position.
template <class Function>
void EndFree(const StepContext& context, const Function& function) {
  Vec4* const p = context.scratch.state.positions.data();
  Vec4* const v = context.scratch.state.velocities.data();
  const bool has_left = context.AnyFreeRange([&](std::span<const uint32_t> particles) {
    const Function local = function;
    ReachWatch watch = WatchOfEnds(context);
    for (const uint32_t i : particles) {
      watch.See(local(i, p[i], v[i]));
    }
    return watch.has_left();
  });
  context.scratch.reach.has_left |= has_left;
}

void PredictPins(const StepContext& context) {
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < context.held.particles.size(); ++k) {
    const uint32_t i = context.held.particles[k];
    const Vec4 way = (context.held.targets[k] - state.positions[i]) / substep.pin_shares;
    state.velocities[i] = way * substep.inverse_duration;
    state.positions[i] += way * substep.pin_lead;
  }
}

void IntegratePins(const StepContext& context) {
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < context.held.particles.size(); ++k) {
    const uint32_t i = context.held.particles[k];
    // At the end of the step a pin is where it was asked to be, to the bit.
    state.positions[i] = substep.pin_shares == 1
                             ? context.held.targets[k]
                             : state.positions[i] + substep.interval * state.velocities[i];
  }
}

}  // namespace

void Predict(const StepContext& context) {
  if (context.substep.is_two_step) {
    if (context.scratch.has_remainders) {
      PredictFree<TwoStepPrediction<true>>(context);
    } else {
      PredictFree<TwoStepPrediction<false>>(context);
    }
  } else {
    PredictFree<BallisticPrediction>(context);
  }
  PredictPins(context);
}

// Bender et al. 2009, section 3.1, eq. 1: p = b + H u; the velocities become v = u + a H/2, with
// two steps they are u.
void PredictPositions(const StepContext& context, float interval) {
  StepScratch& scratch = context.scratch;
  context.ForRanges(scratch.predicted.size(), kParticleGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      scratch.predicted[i] = scratch.state.positions[i] + interval * scratch.state.velocities[i];
    }
  });
}

void Integrate(const StepContext& context) {
  const float interval = context.substep.interval;
  if (context.substep.is_two_step && context.scratch.has_remainders) {
    const float inverse_interval = context.substep.inverse_interval;
    Vec4* const remainders = context.scratch.remainders.data();
    EndFree(context, [=](uint32_t i, Vec4& p, Vec4& v) {
      const Vec4 way = interval * v;
      const Vec4 end = p + way;
      v -= inverse_interval * remainders[i];
      remainders[i] = way - (end - p);
      return p = end;
    });
  } else if (context.substep.is_two_step) {
    EndFree(context, [=](uint32_t, Vec4& p, const Vec4& v) { return p += interval * v; });
  } else {
    const BallisticPrediction second_half(context);
    EndFree(context, [=](uint32_t i, Vec4& p, Vec4& v) {
      const Vec4 end = p + interval * v;
      second_half(i, p, v);
      return p = end;
    });
  }
  IntegratePins(context);
}

}  // namespace drape::cpu
