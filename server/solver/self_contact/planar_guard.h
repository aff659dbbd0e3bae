// Sees to it that no pair passes through itself within a substep.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_pair.h"

namespace drape::self_contact {

// The share of the distance at which a pair touches to which the guard lets it come, if it was not
// nearer [-]. Larger: the guard acts where impulses would do; smaller: rounding takes a larger part
// of what is left between layers.
inline constexpr double kCoreShare = 0.1;

// The guarantee: particles move in straight lines from `starts` to `ends`. A pair that some
// direction separates at both ends of that way is apart all the time, since gaps along a fixed
// direction are linear in time. The guard changes ends until every pair has such a direction.
//
// First impulses push the pairs apart that lack one, a few times. What is left is collected in
// zones, connected by such pairs. In a zone each pair gets two parallel planes that move with the
// zone's mean motion, and each particle stops, relative to that motion, at the first plane that it
// meets. Then the zone moves as a whole so that its momentum is kept. Pairs that lack a direction
// now join; a zone of everything would move as one, so this ends.
template <class V>
class PlanarGuard {
 public:
  using Real = ScalarOf<V>;

  // Of the substep. `velocities` and the history, if any, follow what the guard does to the ends.
  struct Motion {
    std::span<const V> starts;             // [m]
    std::span<V> ends;                     // [m]
    std::span<V> velocities;               // [m/s]
    std::span<V> previous_velocities;      // of two steps, else empty
    std::span<V> previous_positions;       // may be `starts`
    std::span<const Real> inverse_masses;  // [1/kg]
    Real duration;                         // [s]
  };

  // `active`: of `pairs`, all that may touch within the substep; their normal separates them at
  // `starts`, or they are left alone. `ways`: of each of those, how far a particle of one primitive
  // moves at most relative to one of the other [m]. False: pins have forced some pair through
  // itself. What a zone loses to its pins is shared equally among them.
  bool Run(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
           std::span<const Real> ways, const Motion& motion, const HeldPulls<V>& pulls = {},
           Interruption* interruption = nullptr);
  // Whether the last Run changed any end.
  bool has_changed() const { return has_changed_; }

 private:
  struct Zone {
    V way{};       // mean, or that of its pins
    V velocity{};  // mean
    V previous_velocity{};
    V previous_way{};
    V shift{};    // gives back the momentum that stopping takes away
    V stopped{};  // momentum that its pins have taken, and that in the memory of two steps
    V stopped_in_memory{};
    Real mass = 0;
    uint32_t pins = 0;
  };

  Real Core(const ContactPair<V>& pair) const;
  bool IsApart(ContactPair<V>& pair, const Motion& motion) const;
  bool PushApart(std::span<ContactPair<V>> pairs, const Motion& motion);
  bool StopInZones(std::span<ContactPair<V>> pairs, std::span<const uint32_t> active,
                   const Motion& motion);
  void PullPins(const Motion& motion);
  void MoveZones(std::span<ContactPair<V>> pairs, const Motion& motion);
  void LimitWays(const ContactPair<V>& pair, const Motion& motion);
  void EndZones(const Motion& motion);
  uint32_t RootOf(uint32_t particle);
  void Join(const ContactPair<V>& pair);

  HeldPulls<V> pulls_;
  Interruption* interruption_ = nullptr;
  bool has_changed_ = false;
  std::vector<uint32_t> suspects_;  // pairs
  std::vector<uint32_t> stopped_;   // pairs with planes
  std::vector<bool> has_planes_;    // of each active pair
  std::vector<V> wanted_;           // ends before any stopped
  std::vector<uint32_t> parents_;   // of each particle, in the forest of zones; itself: no zone yet
  std::vector<uint32_t> members_;   // particles of zones
  std::vector<bool> is_member_;
  std::vector<Real> shares_;  // of its way that a particle goes
  std::vector<V> pushes_;     // of particles that pins push beyond their start [m]
  std::vector<Zone> zones_;   // by root
};

extern template class PlanarGuard<Vector3f>;
extern template class PlanarGuard<Vector3d>;

}  // namespace drape::self_contact
