#include "server/solver/cpu_reference/reference_impulses.h"

#include <algorithm>

namespace drape::reference {

using Eigen::Vector3d;

ImpulseSums::ImpulseSums(const SceneModel& model, std::span<const Grip> held, size_t collider_count,
                         bool has_contacts)
    : model_(model),
      held_(held),
      of_particles_(model.particle_count(), Vector3d::Zero()),
      colliders_(collider_count),
      contacts_(has_contacts ? model.particle_count() * (collider_count + 1) : 0,
                Vector3d::Zero()) {}

void ImpulseSums::ToHeld(uint32_t particle, const Vector3d& impulse) {
  of_particles_[particle] += weights_.impulse * impulse;
}

void ImpulseSums::ToHeldInMemory(uint32_t particle, const Vector3d& impulse) {
  of_particles_[particle] += weights_.memory * impulse;
}

void ImpulseSums::ToCollider(size_t c, const Vector3d& impulse, const Vector3d& arm_m) {
  AddToCollider(c, weights_.impulse * impulse, arm_m);
}

void ImpulseSums::ToColliderInMemory(size_t c, const Vector3d& impulse, const Vector3d& arm_m) {
  AddToCollider(c, weights_.memory * impulse, arm_m);
}

void ImpulseSums::AddToCollider(size_t c, const Vector3d& impulse, const Vector3d& arm_m) {
  colliders_[c].impulse_n_s += impulse;
  colliders_[c].angular_impulse_n_m_s += arm_m.cross(impulse);
}

Vector3d& ImpulseSums::ContactOf(uint32_t particle, size_t collider) {
  return contacts_[particle * (colliders_.size() + 1) + std::min(collider, colliders_.size())];
}

void ImpulseSums::OnParticle(uint32_t particle, size_t collider, const Vector3d& impulse) {
  if (has_contacts()) ContactOf(particle, collider) += weights_.impulse * impulse;
}

void ImpulseSums::OnParticleInMemory(uint32_t particle, size_t collider, const Vector3d& impulse) {
  if (has_contacts()) ContactOf(particle, collider) += weights_.memory * impulse;
}

std::vector<ParticleImpulse> ImpulseSums::Contacts() const {
  const size_t width = colliders_.size() + 1;
  std::vector<ParticleImpulse> contacts;
  for (size_t k = 0; k < contacts_.size(); ++k) {
    if (contacts_[k].isZero(0)) continue;
    const bool is_cloth = k % width == colliders_.size();
    contacts.push_back({static_cast<uint32_t>(k / width),
                        is_cloth ? ParticleImpulse::kCloth : static_cast<uint32_t>(k % width),
                        contacts_[k]});
  }
  return contacts;
}

StepImpulses ImpulseSums::Total(const ParticleState& start, const ParticleState& end,
                                const Vector3d& gravity_m_per_s2, double duration_s) const {
  StepImpulses total;
  total.colliders = colliders_;
  if (has_contacts()) total.contacts = Contacts();
  for (size_t k = 0; k < held_.size(); ++k) {
    const uint32_t i = held_[k].particle;
    const Vector3d change = end.velocities_m_per_s[i] - start.velocities_m_per_s[i];
    const Vector3d impulse =
        of_particles_[i] + model_.masses_kg()[i] * (duration_s * gravity_m_per_s2 - change);
    if (k < model_.pin_count()) {
      total.pins_n_s.push_back(impulse);
    } else {
      total.grips_n_s.push_back(impulse);
      total.gripped_particles.push_back(i);
    }
  }
  return total;
}

}  // namespace drape::reference
