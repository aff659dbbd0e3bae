// The impulses of a step of one cloth from the sums of its stages (impulse_sums.h), whatever their
// order.
#pragma once

#include <span>
#include <vector>

#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_impulses.h"

namespace drape::cpu {

// A sum of vectors in single precision that does not depend on their order: whole multiples of
// 2^-64, which are exact, and smaller parts of each vector are dropped.
class ExactSum {
 public:
  void Add(Vec4 vector);
  Eigen::Vector3d Value() const;

 private:
  __extension__ using Wide = __int128;
  static constexpr double kUnit = 0x1p64;

  Wide sums_[3] = {};
};

// Collects what a step gave to each particle and each collider in reach. Impulses on particles.
class ImpulseTotal {
 public:
  explicit ImpulseTotal(const StepContext& context)
      : context_(context),
        pulls_(context.held.particles.size()),
        impulses_(context.scratch.reach.near.size()),
        moments_(context.scratch.reach.near.size()) {}

  // Only of held particles.
  void Pull(uint32_t particle, Vec4 impulse) {
    if (particle >= context_.model.particle_count || context_.held.IsFree(particle)) return;
    pulls_[context_.held.PlaceOf(particle)].Add(impulse);
  }
  // On particle i by collider k of those in reach.
  void Push(uint32_t i, size_t k, Vec4 impulse, Vec4 moment) {
    impulses_[k].Add(impulse);
    moments_[k].Add(moment);
    AddContact(i, context_.scratch.reach.near[k], impulse);
  }
  // On particle i by cloth.
  void PushByCloth(uint32_t i, Vec4 impulse) { AddContact(i, ParticleImpulse::kCloth, impulse); }
  // With the weight and the inertia of what is held; `start` and context.scratch.state: the states
  // before and after the step.
  StepImpulses Take(const FloatState& start);

 private:
  void AddContact(uint32_t i, uint32_t collider, Vec4 impulse) {
    if (!context_.asks_for_contacts) return;
    const Eigen::Vector3d on_particle = ToVector3d(impulse);
    if (!on_particle.isZero(0)) contacts_.push_back({i, collider, on_particle});
  }

  const StepContext& context_;
  std::vector<ExactSum> pulls_;               // [held.particles]
  std::vector<ExactSum> impulses_, moments_;  // [reach.near]
  std::vector<ParticleImpulse> contacts_;
};

// Where the pivots of these colliders are at `end_s` of the step [m].
std::vector<Vec4> PivotsAt(const StepContext& context, std::span<const uint32_t> colliders,
                           double end_s);

}  // namespace drape::cpu
