// What a step gives to what is held and to colliders (server/solver/method.md, "Impulses").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/model/held_particles.h"
#include "server/solver/cpu/simd/vec4.h"
#include "server/solver/step_impulses.h"

namespace drape::cpu {

struct StepContext;
struct FloatState;

// Sums of one step. Each place has one writer in a stage, whatever the threads; Total adds the
// places. Impulses are those on particles, held ones and those in contact [N s].
class ImpulseSums {
 public:
  // Of a new step with `near_count` colliders in reach.
  void Begin(const FloatModel& model, size_t near_count, bool has_contacts);
  // Of the substep that begins.
  void BeginSubstep(const StepContext& context, uint32_t index, double substep_s);

  // By a stage in which one thread works on the particle.
  void Pull(uint32_t particle, Vec4 impulse) { particles_[particle] += weight_ * impulse; }
  void PullInMemory(uint32_t particle, Vec4 impulse) {
    particles_[particle] += memory_weight_ * impulse;
  }
  // By one of the links beside the particle: the last particle of a link of a group of strips, or
  // the first one of the group.
  void PullAtLink(size_t link, uint32_t lane, Vec4 impulse) {
    strip_links_[link * kVec8Size + lane] += weight_ * impulse;
  }
  void PullAtFirst(size_t strips, uint32_t lane, Vec4 impulse) {
    strip_firsts_[strips * kVec8Size + lane] += weight_ * impulse;
  }
  // By a constraint: `end` 0 or 1.
  void PullAtConstraint(size_t place, uint32_t end, Vec4 impulse) {
    constraints_[2 * place + end] += weight_ * impulse;
  }
  // By a tether, at its pin; `place`: group * kVec4Size + lane.
  void PullAtTether(size_t place, Vec4 impulse) { tethers_[place] += weight_ * impulse; }
  // By near collider k, on a particle at `place_m` when the substep ends.
  void Push(uint32_t particle, size_t k, Vec4 impulse, Vec4 place_m) {
    Add(particle, k, weight_ * impulse, place_m);
  }
  void PushInMemory(uint32_t particle, size_t k, Vec4 impulse, Vec4 place_m) {
    Add(particle, k, memory_weight_ * impulse, place_m);
  }

  // By cloth; only where contacts are asked for.
  void PushByCloth(uint32_t particle, Vec4 impulse) { by_cloth_[particle] += weight_ * impulse; }
  void PushByClothInMemory(uint32_t particle, Vec4 impulse) {
    by_cloth_[particle] += memory_weight_ * impulse;
  }

  // Of the impulses of a group of hinges on a held particle, by stages.
  std::vector<Vec4> held_hinges;  // [held.particles]

  // After the step; `start`: the state before it.
  StepImpulses Total(const StepContext& context, const FloatState& start) const;

 private:
  struct Contact {
    Vec4 impulse;
    Vec4 moment;  // about the pivot [N m s]
  };

  void Add(uint32_t particle, size_t k, Vec4 impulse, Vec4 place_m);

  float weight_ = 1;
  float memory_weight_ = 0;
  size_t near_count_ = 0;
  std::vector<Vec4> particles_;     // [particle_count + 1]
  std::vector<Vec4> strip_links_;   // [strip_links][lane]
  std::vector<Vec4> strip_firsts_;  // [strips][lane]
  std::vector<Vec4> constraints_;   // [groups][lane][end]
  std::vector<Vec4> tethers_;       // [tethers][lane]
  std::vector<Contact> contacts_;   // [particle_count][near]
  std::vector<Vec4> by_cloth_;      // [particle_count] or empty
  std::vector<Vec4> pivots_;        // [near] where the substep ends [m]
};

}  // namespace drape::cpu
