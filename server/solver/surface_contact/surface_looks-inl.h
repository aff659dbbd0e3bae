// Which parts are looked at in a substep, and what that finds: functions of SurfaceContacts.
#pragma once

#include <algorithm>
#include <array>

#include "server/solver/surface_contact/contact_numbers.h"
#include "server/solver/surface_contact/four_parts.h"
#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::surface_contact {

template <class V>
void SurfaceContacts<V>::LookAtDue(SolidState& solid, std::span<const V> positions,
                                   std::span<const V> velocities) {
  const std::span<const uint32_t> due = solid.wakes.FindDue(substep_, solid.expected);
  ListSearched(solid, due);
  LookAtFour(solid);
  found_.clear();
  auto searched = searched_.begin();
  for (const uint32_t part : due) {
    if (searched != searched_.end() && searched->part == part) {
      Searched& its = *searched++;
      if (!its.is_known) {
        its.lowest = LowestOf(solid, solid.CornerCount(part), CornersOf(solid, part));
      }
      if (!TakePlane(solid, part, its.lowest)) continue;
    }
    if (Look(solid, part, velocities)) found_.push_back(solid.places[part]);
  }
  // When there are all of them: they move when one more is added.
  for (const uint32_t place : found_) Activate(solid.contacts[place], positions, velocities);
}

template <class V>
void SurfaceContacts<V>::ListSearched(const SolidState& solid, std::span<const uint32_t> due) {
  searched_.clear();
  for (const uint32_t part : due) {
    if (!HasPlane(solid, part)) searched_.push_back({part});
  }
}

// Of what is sharp. Around round solids, and above maps, parts are looked at one by one.
template <class V>
void SurfaceContacts<V>::LookAtFour(const SolidState& solid) {
  const Solid<V>& shape = solid.placed.solid();
  if (!shape.is_sharp()) return;
  const auto edges = std::ranges::partition_point(searched_, [&](const Searched& searched) -> bool {
    return searched.part < solid.triangle_count;
  });
  const auto look = [&](std::span<Searched> parts, auto corners, const auto& find) {
    for (size_t begin = 0; begin < parts.size(); begin += kFour) {
      const std::span four = parts.subspan(begin, std::min(kFour, parts.size() - begin));
      for (size_t k = 0; k < kFour; ++k) {
        const auto& its = solid.wakes.corners(four[std::min(k, four.size() - 1)].part);
        for (size_t c = 0; c < corners.size(); ++c) corners[c][k] = solid.described[its[c]];
      }
      const FourLowest<V> lowest = find(corners);
      for (size_t k = 0; k < four.size(); ++k) {
        four[k].is_known = (lowest.known >> k & 1) != 0;
        four[k].lowest = lowest.lowest[k];
      }
    }
  };
  look({searched_.begin(), edges}, CornersOfFour<V, 3>{},
       [&](const auto& corners) { return LowestOnFourTriangles(shape, corners, solid.expected); });
  look({edges, searched_.end()}, CornersOfFour<V, 2>{}, [&](const auto& corners) {
    return LowestOnFourEdges(shape, corners, least_dip_, solid.expected);
  });
}

// One that may be used still.
template <class V>
bool SurfaceContacts<V>::HasPlane(const SolidState& solid, size_t part) const {
  const uint32_t place = solid.places[part];
  if (place == SolidState::kNone) return false;
  const Contact& contact = solid.contacts[place];
  return contact.has_plane && substep_ < contact.found_in + ages_after_ &&
         !(solid.wakes.WayOf(part) - contact.found_at >
           static_cast<Real>(kPlaneTravel) * numbers_.edge_length);
}

// Where its corners are when the substep starts, in the frame of the description; of an edge the
// second one twice.
template <class V>
std::array<V, 3> SurfaceContacts<V>::CornersOf(const SolidState& solid, size_t part) const {
  const auto& [i, j, k] = solid.wakes.corners(part);
  return {solid.described[i], solid.described[j], solid.described[k]};
}

// Whether a part with a plane is near enough to count in the substep.
template <class V>
bool SurfaceContacts<V>::Look(SolidState& solid, size_t part, std::span<const V> velocities) {
  Contact& contact = solid.contacts[solid.places[part]];
  const PlacedSolid<V>& placed = solid.placed;
  const std::array<V, 3> described = CornersOf(solid, part);
  V point{}, velocity{};
  for (uint32_t k = 0; k < contact.count; ++k) {
    point += contact.weights[k] * described[k];
    velocity += contact.weights[k] * velocities[contact.particles[k]];
  }
  contact.gap = self_contact::Dot(contact.normal, point) - contact.level;
  // With what gravity and its neighbours may add.
  const auto h = static_cast<Real>(substep_s_);
  const Real approach =
      std::max(-self_contact::Dot(placed.TurnedAtStart(contact.normal), velocity), Real{0});
  const Real near = static_cast<Real>(kWayMargin) *
                        (approach * h + self_contact::Length(numbers_.gravity) * h * h) +
                    solid.own_way + least_dip_;
  if (contact.gap > near) {
    solid.wakes.Wait(part, contact.gap);
    return false;
  }
  solid.wakes.LookAgain(part);
  return true;
}

// What is lowest inside, or what comes down on the solid next if that is near: found when it has,
// it would be deep at once, and what pushes it out gives it energy, step after step.
template <class V>
LowestPoint<V> SurfaceContacts<V>::LowestOf(const SolidState& solid, uint32_t count,
                                            const std::array<V, 3>& places) {
  const Solid<V>& shape = solid.placed.solid();
  const LowestPoint<V> lowest = count == 2 ? LowestOnEdge(shape, places[0], places[1], least_dip_)
                                           : LowestOnTriangle(shape, places, least_dip_);
  const bool has_ends = shape.kind() == ShapeKind::kCapsule && count == 3;
  if (lowest.is_inside || lowest.gap > solid.expected) return lowest;
  if (!has_ends && (!shape.is_sharp() || lowest.room > 0)) return lowest;
  const LowestPoint<V> next =
      count == 2 ? NextOnEdge(shape, places[0], places[1], least_dip_)
                 : LowestCornerUnder(shape, places, lowest.normal, corners_of_solid_);
  return next.is_inside && next.gap <= solid.expected ? next : lowest;
}

// A contact gets its plane from what is lowest. False: nothing of it is inside; then it is known
// when to look again.
template <class V>
bool SurfaceContacts<V>::TakePlane(SolidState& solid, size_t part, const LowestPoint<V>& lowest) {
  if (!lowest.is_inside) {
    Rest(solid, part, std::max(lowest.room, lowest.gap));
    return false;
  }
  const std::array<V, 3> described = CornersOf(solid, part);
  Contact& contact = ContactOf(solid, part);
  contact.has_plane = true;
  contact.normal = lowest.normal;
  contact.weights = lowest.weights;
  V point{};
  for (uint32_t k = 0; k < contact.count; ++k) point += contact.weights[k] * described[k];
  // A dip that begins to count is at the surface, so that it begins to push with nothing.
  contact.level = self_contact::Dot(contact.normal, point) - lowest.gap - least_dip_;
  contact.found_in = substep_;
  contact.found_at = solid.wakes.WayOf(part);
  return true;
}

// Nothing of it is lowest inside, until a corner may have moved by `free`.
template <class V>
void SurfaceContacts<V>::Rest(SolidState& solid, size_t part, Real free) {
  const uint32_t place = solid.places[part];
  if (place != SolidState::kNone) solid.contacts[place].has_plane = false;
  const bool is_far = free > solid.expected;
  const Real turn = static_cast<Real>(kPlaneTravel) * numbers_.edge_length;
  solid.wakes.Wait(part, is_far ? free : solid.expected + turn,
                   is_far ? Wakes<Real>::kNever : substep_ + ages_after_);
}

// New where it has had no plane yet.
template <class V>
typename SurfaceContacts<V>::Contact& SurfaceContacts<V>::ContactOf(SolidState& solid,
                                                                    size_t part) {
  uint32_t& place = solid.places[part];
  if (place == SolidState::kNone) {
    place = static_cast<uint32_t>(solid.contacts.size());
    Contact& contact = solid.contacts.emplace_back();
    contact.count = solid.CornerCount(part);
    contact.solid = static_cast<uint32_t>(&solid - solids_.data());
    for (uint32_t k = 0; k < contact.count; ++k) {
      contact.particles[k] = solid.watched[solid.wakes.corners(part)[k]];
    }
  }
  return solid.contacts[place];
}

}  // namespace drape::surface_contact
