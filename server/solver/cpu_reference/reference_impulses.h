// What a step gives to what is held and to colliders (server/solver/method.md, "Impulses").
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/backend.h"
#include "server/solver/step_impulses.h"

namespace drape::reference {

// Sums of one step.
class ImpulseSums {
 public:
  // `held`: the pins of the model, then the grips.
  // `has_contacts`: StepImpulses::contacts are asked for.
  ImpulseSums(const SceneModel& model, std::span<const Grip> held, size_t collider_count,
              bool has_contacts);

  // Of the substep that begins.
  void SetWeights(const ImpulseWeights& weights) { weights_ = weights; }
  // Impulses that change velocities of this substep [N s], `arm_m` from the pivot.
  void ToHeld(uint32_t particle, const Eigen::Vector3d& impulse);
  void ToCollider(size_t c, const Eigen::Vector3d& impulse, const Eigen::Vector3d& arm_m);
  // The same for changes of the velocity before the substep, by -impulse.
  void ToHeldInMemory(uint32_t particle, const Eigen::Vector3d& impulse);
  void ToColliderInMemory(size_t c, const Eigen::Vector3d& impulse, const Eigen::Vector3d& arm_m);

  // The same on a particle by its contacts with a collider, or ParticleImpulse::kCloth.
  bool has_contacts() const { return !contacts_.empty(); }
  void OnParticle(uint32_t particle, size_t collider, const Eigen::Vector3d& impulse);
  void OnParticleInMemory(uint32_t particle, size_t collider, const Eigen::Vector3d& impulse);

  // After the step, with the weight and the inertia of what is held.
  StepImpulses Total(const ParticleState& start, const ParticleState& end,
                     const Eigen::Vector3d& gravity_m_per_s2, double duration_s) const;

 private:
  std::vector<ParticleImpulse> Contacts() const;
  Eigen::Vector3d& ContactOf(uint32_t particle, size_t collider);
  void AddToCollider(size_t c, const Eigen::Vector3d& impulse, const Eigen::Vector3d& arm_m);

  const SceneModel& model_;
  const std::span<const Grip> held_;
  ImpulseWeights weights_;
  std::vector<Eigen::Vector3d> of_particles_;  // of those that are held
  std::vector<ColliderImpulse> colliders_;
  std::vector<Eigen::Vector3d> contacts_;  // [particle_count][collider_count + 1], last by cloth
};

}  // namespace drape::reference
