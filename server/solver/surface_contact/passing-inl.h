// What may get across something thin: functions of SurfaceContacts.
#pragma once

#include <array>

#include "server/solver/surface_contact/contact_numbers.h"
#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::surface_contact {

// Particles that may get to the other side within the substep. Where one is inside, its thickness
// included, the nearest face is the one that it came through: nothing is left deeper than half.
template <class V>
void SurfaceContacts<V>::FindPassing(SolidState& solid, std::span<const V> positions) {
  if (solid.is_given_up) return;
  const auto give_up = [&] {
    DropPassing(solid);
    solid.passing.shrink_to_fit();
  };
  const PlacedSolid<V>& placed = solid.placed;
  solid.sides.resize(positions.size());
  for (size_t k = 0; k < solid.near.size(); ++k) {
    if (solid.travel + solid.expected < solid.near_travels[k]) continue;
    const uint32_t i = solid.near[k];
    const V start = placed.DescribedAtStart(positions[i]);
    const Gap<V> at = placed.solid().At(start);
    solid.near_travels[k] = solid.travel + at.gap;
    if (at.gap > solid.expected) continue;
    Contact contact;
    contact.count = 1;
    contact.particles[0] = i;
    contact.solid = static_cast<uint32_t>(&solid - solids_.data());
    contact.weights[0] = 1;
    contact.is_passing = true;
    contact.has_plane = at.gap < 0;
    contact.normal = at.normal;
    contact.level = self_contact::Dot(at.normal, start) - at.gap;
    // What other contacts have moved beyond the middle since goes back.
    V& side = solid.sides[i];
    contact.has_slipped =
        contact.has_plane && placed.solid().is_convex() && self_contact::Dot(at.normal, side) < 0;
    if (contact.has_slipped) {
      contact.normal = side;
      contact.level =
          self_contact::Dot(side, placed.solid().Farthest(side)) + placed.solid().offset();
    } else {
      side = at.normal;
    }
    if (!HasRoom(solid)) return give_up();
    solid.passing.push_back(contact);
  }
  if (!placed.solid().is_convex()) return;
  for (size_t part = solid.triangle_count; part < solid.places.size(); ++part) {
    if (!solid.wakes.MayBeNear(part, solid.expected)) continue;
    Contact contact;
    contact.count = 2;
    for (uint32_t k = 0; k < 2; ++k) {
      contact.particles[k] = solid.watched[solid.wakes.corners(part)[k]];
    }
    contact.solid = static_cast<uint32_t>(&solid - solids_.data());
    contact.is_passing = true;
    if (!HasRoom(solid)) return give_up();
    solid.passing.push_back(contact);
  }
}

// Whether a particle that starts outside meets the solid on its way so far: the plane there stops
// it for the rest of the substep.
template <class V>
bool SurfaceContacts<V>::FindMeeting(Contact& contact, const V* base, const V* u,
                                     Real interval) const {
  const PlacedSolid<V>& placed = solids_[contact.solid].placed;
  const uint32_t i = contact.particles[0];
  const V start = placed.DescribedAtStart(starts_[i]);
  const V end = placed.DescribedAtEnd(V(base[i] + interval * u[i]));
  V place{};
  if (!Meets(placed.solid(), start, end, place, contact.normal)) return false;
  contact.level = self_contact::Dot(contact.normal, place);
  contact.has_plane = true;
  SetUp(contact, starts_[i]);
  return true;
}

// The same of the inside of an edge.
template <class V>
bool SurfaceContacts<V>::FindMeetingOfEdge(Contact& contact, const V* base, const V* u,
                                           Real interval) const {
  const PlacedSolid<V>& placed = solids_[contact.solid].placed;
  std::array<V, 2> starts, ends;
  for (uint32_t k = 0; k < 2; ++k) {
    const uint32_t i = contact.particles[k];
    starts[k] = placed.DescribedAtStart(starts_[i]);
    ends[k] = placed.DescribedAtEnd(V(base[i] + interval * u[i]));
  }
  LowestPoint<V> lowest;
  if (!MeetsEdge(placed.solid(), starts, ends, least_dip_, lowest)) return false;
  contact.normal = lowest.normal;
  contact.weights = lowest.weights;
  // The plane behind which the solid lies, as high above it as all of the edge is then.
  contact.level = self_contact::Dot(contact.normal, placed.solid().Farthest(contact.normal)) +
                  placed.solid().offset() - least_dip_;
  V place{};
  contact.inverse_mass = 0;
  contact.velocity = V{};
  for (uint32_t k = 0; k < contact.count; ++k) {
    const uint32_t i = contact.particles[k];
    place += contact.weights[k] * starts_[i];
    contact.inverse_mass += contact.weights[k] * contact.weights[k] * numbers_.inverse_masses[i];
    contact.velocity += contact.weights[k] * velocities_[i];
  }
  if (!(contact.inverse_mass > 0)) return false;
  contact.has_plane = true;
  contact.push = 0;
  contact.tangent = V{};
  SetUp(contact, place);
  return true;
}

}  // namespace drape::surface_contact
