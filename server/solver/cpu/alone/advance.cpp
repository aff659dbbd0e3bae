#include "server/solver/cpu/alone/advance.h"

#include <algorithm>
#include <span>

#include "server/solver/cpu/alone/tethers.h"
#include "server/solver/cpu/step/collider_reach.h"

namespace drape::cpu {
namespace {

// Blocks that the first-level cache holds: 8 KiB of positions and velocities, before and now.
constexpr size_t kVisitBlocks = 32;

// Bender et al. 2009, section 3.1, eq. 2: the velocities become u = v + a H/2.
class BallisticPrediction {
 public:
  explicit BallisticPrediction(const StepContext& context)
      : accelerations_(context.controls.has_spring_forces ? context.scratch.accelerations.data()
                                                          : nullptr),
        half_interval_(context.substep.half_interval),
        kick_(context.controls.gravity * half_interval_) {}
  void operator()(uint32_t i, Lanes&, Lanes& v) const {
    v += accelerations_ != nullptr ? accelerations_[i] * half_interval_ : kick_;
  }

 private:
  const Lanes* const accelerations_;
  const float half_interval_;
  const Lanes kick_;
};

// The backward differentiation formula of second order: the positions become b = p + (p - p')/3,
// the velocities u = (v + (v - v')/3 + H g) / (1 + c H).
class TwoStepPrediction {
 public:
  explicit TwoStepPrediction(const StepContext& context)
      : previous_positions_(context.scratch.previous.positions.data()),
        previous_velocities_(context.scratch.previous.velocities.data()),
        kick_(context.controls.gravity * context.substep.interval),
        damping_factor_(context.substep.damping_factor),
        sets_previous_(context.substep.sets_previous) {}
  void operator()(uint32_t i, Lanes& p, Lanes& v) const {
    constexpr float kThird = 1.0f / 3;
    Lanes& previous_p = previous_positions_[i];
    Lanes& previous_v = previous_velocities_[i];
    const Lanes base = p + (p - previous_p) * kThird;
    const Lanes mean = ((v + (v - previous_v) * kThird) + kick_) * damping_factor_;
    if (sets_previous_) {
      previous_p = p;
      previous_v = v;
    }
    p = base;
    v = mean;
  }

 private:
  Lanes* const previous_positions_;
  Lanes* const previous_velocities_;
  const Lanes kick_;
  const float damping_factor_;
  const bool sets_previous_;
};

template <class Prediction>
void PredictFreeWith(const StepContext& context) {
  Lanes* const p = context.scratch.state.positions.data();
  Lanes* const v = context.scratch.state.velocities.data();
  const Prediction predict(context);
  context.ForFreeParticles([=](uint32_t i) { predict(i, p[i], v[i]); });
}

// Of where particles end a substep.
ReachWatch WatchOfEnds(const StepContext& context) {
  const ColliderReach& reach = context.scratch.reach;
  return {reach.range, reach.WatchesEnds(context.max_iterations)};
}

// function(i, p, v) of every free particle ends its substep.
template <class Function>
void EndFree(const StepContext& context, const Function& function) {
  Lanes* const p = context.scratch.state.positions.data();
  Lanes* const v = context.scratch.state.velocities.data();
  const bool has_left = context.AnyFreeRange([&](std::span<const uint32_t> particles) {
    const Function local = function;
    ReachWatch watch = WatchOfEnds(context);
    for (const uint32_t i : particles) {
      local(i, p[i], v[i]);
      watch.See(p[i]);
    }
    return watch.has_left();
  });
  context.scratch.reach.has_left |= has_left;
}

// Of the blocks [begin, end): four free particles each, then their tethers. Returns whether a
// particle had left the range at the end of the substep before.
template <class Prediction>
bool PrepareBlocks(const StepContext& context, const std::optional<Ending>& open, bool has_tethers,
                   size_t begin, size_t end) {
  const std::vector<uint32_t>& particles = context.model.free_particles;
  Lanes* const positions = context.scratch.state.positions.data();
  Lanes* const velocities = context.scratch.state.velocities.data();
  const Prediction predict(context);
  ReachWatch watch = WatchOfEnds(context);
  const size_t last = std::min(particles.size(), end * kLaneCount);
  for (size_t k = begin * kLaneCount; k < last; ++k) {
    const uint32_t i = particles[k];
    Lanes p = positions[i], v = velocities[i];
    if (open) {
      (*open)(p, v);
      watch.See(p);
    }
    predict(i, p, v);
    positions[i] = p;
    velocities[i] = v;
  }
  if (has_tethers) PullBlocks(context, begin, end);
  return watch.has_left();
}

}  // namespace

void PredictFree(const StepContext& context) {
  if (context.substep.is_two_step) {
    PredictFreeWith<TwoStepPrediction>(context);
  } else {
    PredictFreeWith<BallisticPrediction>(context);
  }
}

void PredictPins(const StepContext& context) {
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    const uint32_t i = context.model.pins[k];
    const Lanes way = (context.pin_targets[k] - state.positions[i]) / substep.pin_shares;
    state.velocities[i] = way * substep.inverse_duration;
    state.positions[i] += way * substep.pin_lead;
  }
}

// Bender et al. 2009, section 3.1, eq. 1: p = b + H u; the velocities become v = u + a H/2, with
// two steps they are u.
void Integrate(const StepContext& context) {
  const float interval = context.substep.interval;
  if (context.substep.is_two_step) {
    EndFree(context, [=](uint32_t, Lanes& p, const Lanes& v) { p += interval * v; });
  } else {
    const BallisticPrediction second_half(context);
    EndFree(context, [=](uint32_t i, Lanes& p, Lanes& v) {
      p += interval * v;
      second_half(i, p, v);
    });
  }
  IntegratePins(context);
}

void IntegratePins(const StepContext& context) {
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    const uint32_t i = context.model.pins[k];
    // At the end of the step a pin is where it was asked to be, to the bit.
    state.positions[i] = substep.pin_shares == 1
                             ? context.pin_targets[k]
                             : state.positions[i] + substep.interval * state.velocities[i];
  }
}

bool HasOneVisit(const StepContext& context) {
  const FloatControls& controls = context.controls;
  return !controls.has_spring_forces && !controls.has_half_kicks && !controls.has_air_forces &&
         !context.model.has_elastic() && context.scratch.reach.near.empty() &&
         context.own_lengths == nullptr && controls.solver.velocity_iterations == 0;
}

Ending::Ending(const StepContext& context)
    : is_two_step_(context.substep.is_two_step),
      interval_(context.substep.interval),
      damping_factor_(context.substep.damping_factor),
      kick_(context.controls.gravity * context.substep.half_interval) {}

void PrepareInOneVisit(const StepContext& context, const std::optional<Ending>& open,
                       bool has_tethers) {
  const size_t blocks = context.model.tether_block_offsets.size() - 1;
  const auto prepare = context.substep.is_two_step ? PrepareBlocks<TwoStepPrediction>
                                                   : PrepareBlocks<BallisticPrediction>;
  const bool has_left =
      context.team.AnyOf(0, blocks, kBlockGrain, [&](size_t begin, size_t end, uint32_t) {
        bool has_any_left = false;
        for (size_t now = begin; now < end; now += kVisitBlocks) {
          const size_t next = std::min(now + kVisitBlocks, end);
          has_any_left |= prepare(context, open, has_tethers, now, next);
        }
        return has_any_left;
      });
  context.scratch.reach.has_left |= has_left;
}

void End(const StepContext& context, const Ending& open) {
  EndFree(context, [=](uint32_t, Lanes& p, Lanes& v) { open(p, v); });
}

}  // namespace drape::cpu
