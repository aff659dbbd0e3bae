// The impulses of pairs within a substep, and how they stop at its end (server/solver/method.md,
// solve_self_contacts and the end of guard_self_contacts).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/planar_guard.h"
#include "server/solver/self_contact/step_numbers.h"

namespace drape::self_contact {

// Working memory between steps. One thread.
template <class V>
class PairImpulses {
 public:
  using Real = ScalarOf<V>;

  void Begin(const ContactSurface& surface, const StepNumbers<V>& numbers);
  // From 1; velocities [particle_count] [m/s].
  void BeginSubstep(uint32_t substep, std::span<const V> velocities);
  // Of a pair that was looked at where the substep begins: whether it is left alone or rests, and
  // its floor.
  void BeginPair(ContactPair<V>& pair, bool is_apart, const V* starts) const;

  // Particles are predicted at base + interval u, from `starts`; [particle_count] each.
  struct Prediction {
    const V* starts;
    const V* base;
    V* u;
    Real interval;
  };
  // The impulses of a pair in a sweep. The square of the change of its relative velocity.
  Real Push(ContactPair<V>& pair, const Prediction& at);
  // Of the active ones those that have pushed, at the end of the substep.
  void Stop(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
            const typename PlanarGuard<V>::Motion& motion);

 private:
  // How the pair moves when the substep begins.
  void FindSpeed(ContactPair<V>& pair) const;
  bool IsLanding(const ContactPair<V>& pair, const V& relative_velocity) const;
  static Real ErrorOf(const ContactPair<V>& pair, const Prediction& at);
  // Of a pair at the border of a primitive that is about to push: what its nearest points miss.
  Real ErrorAtBorder(ContactPair<V>& pair, const Prediction& at) const;
  FrictionNumbers<Real> FrictionOf(const ContactPair<V>& pair) const;
  void StopPair(ContactPair<V>& pair, V* velocities, bool is_last);
  void ForgetLanding(const ContactPair<V>& pair, const typename PlanarGuard<V>::Motion& motion);

  const ContactSurface* surface_ = nullptr;
  StepNumbers<V> numbers_;
  bool has_friction_ = false;  // any of the cloths
  Real substep_s_ = 0;
  uint32_t substep_ = 0;             // the one under way, from 1
  std::vector<V> start_velocities_;  // of the substep
  std::vector<uint32_t> landed_;     // pairs of the substep
};

extern template class PairImpulses<Vector3f>;
extern template class PairImpulses<Vector3d>;

}  // namespace drape::self_contact
