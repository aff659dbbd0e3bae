// The contacts of the insides of edges and triangles with colliders during a step
// (server/solver/method.md, "Edges and triangles"), in single or double precision.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/solver/collider_contact.h"
#include "server/solver/surface_contact/lowest_point.h"
#include "server/solver/surface_contact/placed_solid.h"
#include "server/solver/surface_contact/surface_parts.h"
#include "server/solver/surface_contact/wakes.h"

namespace drape::surface_contact {

// Limit on the edges, triangles and particles of one cloth that may come near its solids, each
// counted once for each: where hundreds of solids are in one place, that is all pairs there are,
// and would take all memory. A cloth of 50 000 particles that is flung at 16 has about as many.
inline constexpr size_t kMostContacts = size_t{1} << 22;

// What a step needs to know of the cloth.
template <class V>
struct StepNumbers {
  using Real = ScalarOf<V>;

  V gravity{};  // [m/s^2]
  Real friction_static = 0;
  Real friction_dynamic = 0;
  Real restitution = 0;
  Real slowest_rebound = 0;  // SlowestRebound [m/s]
  Real slowest_landing = 0;  // SlowestLanding [m/s]
  Real edge_length = 0;      // of a typical edge [m]
  double time_step_s = 0;
  uint32_t substeps = 1;
  bool has_two_steps = false;
  std::span<const Real> inverse_masses;  // [particle_count] [1/kg], 0 of what is held
  Interruption* interruption = nullptr;  // asked for each solid; null: nobody is
  size_t most_contacts = kMostContacts;
};

// The point of an edge or a triangle, or a particle, that may touch a solid in a substep.
template <class V>
struct SurfaceContact {
  using Real = ScalarOf<V>;

  std::array<uint32_t, 3> particles{};
  uint32_t count = 0;  // of the particles
  uint32_t solid = 0;
  // The plane behind which the solid lies, in the frame of its description: normal·x = level.
  V normal{};
  Real level = 0;
  std::array<Real, 3> weights{};
  Real inverse_mass = 0;  // of the point [1/kg]
  bool has_plane = false;
  bool has_slipped = false;  // beyond the middle of the solid since the last substep
  bool is_passing = false;   // its plane is where it meets the solid on its way
  uint32_t found_in = 0;     // substep in which the plane was found
  Real found_at = 0;         // travel then [m]
  V velocity{};              // of the point when the substep starts [m/s]
  // Of the substep.
  V push_along{};           // the normal where the substep ends
  V surface_way{};          // of the surface's point that is there when it starts [m]
  Real gap = 0;             // when it starts [m]
  Real floor = 0;           // lowest gap that its end may have [m]
  Real rebound = 0;         // speed with which the point leaves if it hits [m/s]
  bool has_landed = false;  // if it hits
  Real push = 0;            // accumulated impulse, as a change of the point's velocity [m/s]
  V tangent{};              // the same across the normal
  // What the substep gave to the cloth, and to the state before it [N s].
  V given{}, given_in_memory{};
};

// Working memory of a step with so many pairs of a particle and a solid [bytes], about what it is
// at most: vectors of each pair, and contacts, as if all of its edges and triangles had them. Where
// each is near few solids it is a tenth of that.
template <class V>
uint64_t MostBytes(uint64_t pairs) {
  constexpr uint64_t kVectors = 3, kContactsPerPair = 6;  // itself, its edges and triangles
  constexpr uint64_t kContactBytes = 3 * sizeof(SurfaceContact<V>) / 2;  // lists grow by doubling
  const uint64_t contacts = std::min<uint64_t>(kContactsPerPair * pairs, kMostContacts);
  return kVectors * sizeof(V) * pairs + kContactBytes * contacts;
}

// Working memory between steps; a step depends on its arguments alone. One thread.
template <class V>
class SurfaceContacts {
 public:
  using Real = ScalarOf<V>;
  using Contact = SurfaceContact<V>;

  // The solids of a step: those of the colliders among `places` that edges touch (TouchesEdges).
  // `motions`: of all colliders, or empty.
  struct Solids {
    std::span<const Collider> colliders;
    std::span<const RigidMotion> motions;
    std::span<const uint32_t> places;
    double thickness_m = 0;
    EdgesOfStep edges{};
  };
  void Begin(const SurfaceParts& parts, const Solids& solids, const StepNumbers<V>& numbers);

  // Begins a substep from this state; after the first one the positions are those of Advance.
  void Find(std::span<const V> positions, std::span<const V> velocities);
  // One sweep over the contacts; the particles are predicted at base + interval u. Whether a
  // velocity changed by more than `least_change` [m/s].
  bool Solve(const V* base, V* u, Real interval, Real least_change);
  // After the particles have moved from `positions` of Find to these.
  void Advance(std::span<const V> positions);
  // Ends the substep: nothing approaches what it touches, and friction has its part. `previous_*`:
  // the state before the substep, with two steps.
  void Correct(const V* positions, V* velocities, V* previous_positions, V* previous_velocities);

  // Whether in some substep more than StepNumbers::most_contacts could come near. The particles
  // alone touch solids then for which there is no room.
  bool has_given_up() const { return has_given_up_; }

  // Those that have a part in the substep.
  std::span<const Contact* const> active() const { return active_; }
  const PlacedSolid<V>& solid(const Contact& contact) const {
    return solids_[contact.solid].placed;
  }
  // The largest error that the sweeps have left [m].
  Real LargestError(const V* base, const V* u, Real interval) const;

 private:
  // A solid and what may touch it. None depends on what other solids there are: those out of reach
  // may be left out.
  struct SolidState {
    static constexpr uint32_t kNone = UINT32_MAX;

    PlacedSolid<V> placed;
    // Edges and triangles that may come near, the parts of `wakes`: triangles first. Most never get
    // a plane, so there are contacts of the others alone, and what all have stays in the caches.
    size_t triangle_count = 0;
    std::vector<uint32_t> places{};   // of parts in `contacts`, kNone: it has had no plane yet
    std::vector<Contact> contacts{};  // of parts
    std::vector<uint32_t> watched{};  // particles of parts, ascending
    // Of these: where they are when the substep starts, in the frame of the description.
    std::vector<V> described{};
    Wakes<Real> wakes{};               // of parts, whose corners are among `watched`
    std::vector<uint32_t> near{};      // particles that may come near
    std::vector<Real> near_travels{};  // of these: looked at when it has come [m]
    std::vector<V> sides{};  // [particle_count] where each was outwards last in this step, or 0
    std::vector<Contact> passing{};  // what may get across within a substep; particles first
    bool needs_search = true;
    bool is_given_up = false;          // until the next search
    uint32_t searched_in = 0;          // substep
    std::vector<V> found_positions{};  // of the search
    Real reach = 0;                    // what the search allows for [m]
    // How far particles may have come since the search, relative to the solid, and what is expected
    // of this substep [m].
    Real travel = 0, expected = 0;
    Real particle_way = 0;  // of the fastest particle in the last substep [m]
    Real own_way = 0;       // of the solid in a substep, at most [m]

    bool has_any() const { return !places.empty() || !near.empty(); }
    uint32_t CornerCount(size_t part) const { return part < triangle_count ? 3 : 2; }
  };

  void Search(SolidState& solid, std::span<const V> positions, std::span<const V> velocities);
  void FindCandidates(SolidState& solid, std::span<const V> positions);
  void Add(SolidState& solid, std::span<const uint32_t> particles, Real bound);
  bool HasRoom(SolidState& solid);
  void DropParts(SolidState& solid);
  void DropPassing(SolidState& solid);
  void Watch(SolidState& solid, size_t particle_count);
  void FindPassing(SolidState& solid, std::span<const V> positions);
  bool FindMeeting(Contact& contact, const V* base, const V* u, Real interval) const;
  bool FindMeetingOfEdge(Contact& contact, const V* base, const V* u, Real interval) const;
  void LookAtDue(SolidState& solid, std::span<const V> positions, std::span<const V> velocities);
  void ListSearched(const SolidState& solid, std::span<const uint32_t> due);
  void LookAtFour(const SolidState& solid);
  bool Look(SolidState& solid, size_t part, std::span<const V> velocities);
  bool HasPlane(const SolidState& solid, size_t part) const;
  std::array<V, 3> CornersOf(const SolidState& solid, size_t part) const;
  LowestPoint<V> LowestOf(const SolidState& solid, uint32_t count, const std::array<V, 3>& places);
  bool TakePlane(SolidState& solid, size_t part, const LowestPoint<V>& lowest);
  void Rest(SolidState& solid, size_t part, Real free);
  Contact& ContactOf(SolidState& solid, size_t part);
  void Activate(Contact& contact, std::span<const V> positions, std::span<const V> velocities);
  void SetUp(Contact& contact, const V& place) const;
  bool SolveOne(Contact& contact, const V* base, V* u, Real interval, Real least_change);
  bool SolvePlane(Contact& contact, const V* base, V* u, Real interval, Real least_change);
  void CorrectOne(Contact& contact, const V* positions, V* velocities);
  void ForgetFlight(Contact& contact, const V* positions, const V* velocities,
                    V* previous_positions, V* previous_velocities) const;
  void Apply(Contact& contact, const V& change, V* velocities) const;
  V Friction(const V& wanted, Real push) const;
  V WayOf(const Contact& contact, const V* base, const V* u, Real interval) const;
  Real LeastDip(std::span<const V> positions) const;

  const SurfaceParts* parts_ = nullptr;
  StepNumbers<V> numbers_;
  double substep_s_ = 0;
  uint32_t substep_ = 0;     // the one under way, from 1
  uint32_t ages_after_ = 1;  // substeps for which a plane is used
  Real least_dip_ = 0;       // [m]
  std::vector<SolidState> solids_;
  size_t contact_count_ = 0;  // of all their parts and what may get across
  bool has_given_up_ = false;
  std::vector<Contact*> active_;
  std::vector<Contact*> active_particles_;  // of these, those that may get across
  bool looks_on_ways_ = true;               // in the pass under way
  std::vector<V> starts_, velocities_;      // when the substep starts, if anything is near
  bool has_starts_ = false;
  // Of a search.
  std::vector<Gap<V>> gaps_;
  std::vector<V> described_;
  std::vector<typename Wakes<Real>::Corners> corners_;  // particles of the parts of a solid
  std::vector<Real> bounds_;                            // of these parts
  std::vector<uint32_t> watched_;    // [particle_count] place among those that are watched
  std::vector<V> corners_of_solid_;  // LowestCornerUnder
  // Of the parts of a solid that are due and have no plane, or an old one.
  struct Searched {
    uint32_t part = 0;
    bool is_known = false;
    LowestPoint<V> lowest{};  // if it is known
  };
  std::vector<Searched> searched_;
  std::vector<uint32_t> found_;  // places of contacts that have a part in the substep
};

extern template class SurfaceContacts<self_contact::Vector3f>;
extern template class SurfaceContacts<self_contact::Vector3d>;

}  // namespace drape::surface_contact
