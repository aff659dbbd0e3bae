// Two paths of each cloth of a group: what the templates of `step/` that solve paths need of their
// particles. Two, so that one fills the time that the other waits for a division. Compiled once per
// instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_PATH_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_PATH_PAIRS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_PATH_PAIRS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_PATH_PAIRS_INL_H_
#endif

#include <array>

#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

class PathPairs {
 public:
  using Scalars = VecPair;
  using Vectors = VectorsPair;
  using Ends = std::array<uint32_t, 2>;

  explicit PathPairs(const GroupContext& context)
      : PathPairs(context, context.substep.interval, context.substep.inverse_interval) {}
  // Particles are predicted after `interval`.
  PathPairs(const GroupContext& context, float interval, float inverse_interval)
      : context_(context),
        interval_(interval),
        inverse_interval_(inverse_interval),
        particles_(context.particles) {}

  PairLinkSolution* solution() const { return context_.path_solution; }
  float interval() const { return interval_; }
  float inverse_interval() const { return inverse_interval_; }
  float inverse_force_time() const { return context_.substep.inverse_force_time; }
  float force_time() const { return context_.substep.force_time; }
  static VecPair Splat(float value) { return {SplatCloths(value), SplatCloths(value)}; }
  static VecPair Number(NumberPair number) {
    return {SplatCloths(number.low), SplatCloths(number.high)};
  }

  VectorsPair PositionDifferences(const Ends& from, const Ends& to) const {
    return Join(particles_[to[0]].p - particles_[from[0]].p,
                particles_[to[1]].p - particles_[from[1]].p);
  }
  VectorsPair VelocityDifferences(const Ends& from, const Ends& to) const {
    return Join(particles_[to[0]].u - particles_[from[0]].u,
                particles_[to[1]].u - particles_[from[1]].u);
  }
  VectorsPair PredictedDifferences(const Ends& from, const Ends& to) const {
    return PositionDifferences(from, to) + Splat(interval()) * VelocityDifferences(from, to);
  }
  void Push(const Ends& particles, bool /*has_pins*/, const VectorsPair& change) const {
    ClothParticle& low = particles_[particles[0]];
    low.u = low.u + Low(change);
    ClothParticle& high = particles_[particles[1]];
    high.u = high.u + High(change);
  }

  // Of paths of which no two have a particle in common.
  float largest_force_interval() const {
    return static_cast<float>(context_.controls.plan.schedule.largest_force_interval_s2());
  }
  VectorsPair* right_sides() const { return context_.given->right_sides(); }
  void Pull(const Ends& particles, bool has_pins, const VectorsPair& impulses) const {
    if (!has_pins && !context_.has_own_pins()) return;
    const GroupImpulses& given = *context_.given;
    if (given.IsHeld(particles[0])) given.Pull(particles[0], Low(impulses));
    if (given.IsHeld(particles[1])) given.Pull(particles[1], High(impulses));
  }

 protected:
  const GroupContext& context() const { return context_; }

 private:
  const GroupContext& context_;
  const float interval_, inverse_interval_;
  ClothParticle* const particles_;
};

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
