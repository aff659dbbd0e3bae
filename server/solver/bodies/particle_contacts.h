// The contacts of one body with the particles of a cloth: impulses that act on both.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "server/solver/bodies/body_numbers.h"
#include "server/solver/bodies/placed_collider.h"
#include "server/solver/step_impulses.h"

namespace drape::bodies {

// A particle in a substep, where it starts; its velocity is passed beside it.
struct Particle {
  uint32_t index = 0;
  Eigen::Vector3d start_m = Eigen::Vector3d::Zero();
  double mass_kg = 0;  // infinite of what is held: its velocity is what the client asks for

  bool is_held() const { return std::isinf(mass_kg); }
};

// Contacts are solved one after the other, each with what the others have left of the body: so many
// light particles move a heavy body as well as few, and the other way round.
class ParticleContacts {
 public:
  // `round_off`: of the positions that particles have, relative to their size [-].
  ParticleContacts(size_t particle_count, double round_off)
      : places_(particle_count), round_off_(round_off) {}

  // From now on keeps what each particle gets.
  void KeepOfParticles() { of_particles_.assign(places_.size(), Eigen::Vector3d::Zero()); }
  // A substep begins: nothing touches.
  void Begin();
  // Before the substep: how fast a particle with velocity v leaves the body if it hits it.
  void Predict(const PlacedCollider& body, const BodyNumbers& numbers, const Particle& particle,
               const Eigen::Vector3d& v);
  // One sweep over one particle with the mean velocity u of the substep. Returns how much of it
  // has changed [m/s].
  double Solve(PlacedCollider& body, const BodyNumbers& numbers, double seconds,
               const Particle& particle, Eigen::Vector3d& u);
  // At the end of the substep, when the particle is at p: no velocity into the body is left.
  void Correct(PlacedCollider& body, const BodyNumbers& numbers, const Particle& particle,
               const Eigen::Vector3d& p, Eigen::Vector3d& v);

  bool HasPushed(uint32_t particle) const {
    return places_[particle] != 0 && contacts_[places_[particle] - 1].normal > 0;
  }
  // Particles that have pushed in this substep, ascending.
  std::vector<uint32_t> Pushed() const;
  // What the last call of Solve or Correct gave to its particle [N s].
  const Eigen::Vector3d& last_impulse() const { return last_impulse_; }
  // What the cloth gave to the body in all substeps so far, the moment about its centre.
  const ColliderImpulse& given() const { return given_; }
  // What the body gave to each particle in all substeps so far [N s]; empty: not kept.
  const std::vector<Eigen::Vector3d>& of_particles() const { return of_particles_; }

 private:
  // Impulses in this substep [N s].
  struct Contact {
    uint32_t particle = 0;
    double normal = 0;
    Eigen::Vector3d tangent = Eigen::Vector3d::Zero();
    double rebound = 0;  // [m/s]
  };

  // Of a particle, a new one if it has none; until the next one is made.
  Contact& ContactOf(uint32_t particle);
  void Apply(PlacedCollider& body, const Particle& particle, const Eigen::Vector3d& impulse,
             const Eigen::Vector3d& arm_m, Eigen::Vector3d& velocity);
  // Stops what slides at `velocity` beside the normal n, within Coulomb's law for the impulse
  // `normal`.
  void Rub(PlacedCollider& body, const BodyNumbers& numbers, const Particle& particle,
           Contact& contact, double normal, const Eigen::Vector3d& sliding,
           const Eigen::Vector3d& arm_m, Eigen::Vector3d& velocity);

  // Few of many particles touch: only those have contacts.
  std::vector<Contact> contacts_;
  std::vector<uint32_t> places_;  // [particle_count]: from 1; 0: no contact
  double round_off_;
  ColliderImpulse given_;
  std::vector<Eigen::Vector3d> of_particles_;
  Eigen::Vector3d last_impulse_ = Eigen::Vector3d::Zero();
};

}  // namespace drape::bodies
