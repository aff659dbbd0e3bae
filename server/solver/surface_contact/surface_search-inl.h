// What may come near a solid: functions of SurfaceContacts.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "server/solver/solver_constants.h"
#include "server/solver/surface_contact/contact_numbers.h"
#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::surface_contact {

// So that rounding of what is far from the origin does not count either.
template <class V>
ScalarOf<V> SurfaceContacts<V>::LeastDip(std::span<const V> positions) const {
  Real farthest = 0;
  for (const V& p : positions)
    farthest = std::max(farthest, self_contact::LargestOf(self_contact::Abs(p)));
  return std::max(
      static_cast<Real>(kLeastDip) * numbers_.edge_length,
      static_cast<Real>(kTouchRoundOffs) * std::numeric_limits<Real>::epsilon() * farthest);
}

template <class V>
void SurfaceContacts<V>::Search(SolidState& solid, std::span<const V> positions,
                                std::span<const V> velocities) {
  solid.needs_search = false;
  solid.is_given_up = false;
  solid.searched_in = substep_;
  Drop(solid.candidates);
  solid.near.clear();
  solid.near_travels.clear();
  bounds_.clear();
  solid.found_positions.assign(positions.begin(), positions.end());
  self_contact::Box<V> box;
  Real speed_sq = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    box.Add(positions[i]);
    speed_sq = std::max(speed_sq, self_contact::SquaredLength(velocities[i]));
  }
  const auto h = static_cast<Real>(substep_s_);
  const Real rest = static_cast<Real>(numbers_.substeps - substep_ + 1) * h;
  const Real speed = std::sqrt(speed_sq) + self_contact::Length(numbers_.gravity) * rest;
  const Real own_speed = solid.placed.SpeedWithin(
      solid.placed.FarthestFromPivot(box.low, box.high) + static_cast<Real>(kReach) * speed * rest);
  solid.own_way = own_speed * h;
  solid.travel = 0;
  solid.particle_way = std::sqrt(speed_sq) * h;
  solid.reach = static_cast<Real>(kReach) * (speed + own_speed) * rest +
                static_cast<Real>(kReachMargin) * numbers_.edge_length;
  FindCandidates(solid, positions);
  Watch(solid, positions.size());
}

// Of a convex solid each tangent plane bounds the gap of all corners, of any the gap of a corner
// less the way from there.
template <class V>
void SurfaceContacts<V>::FindCandidates(SolidState& solid, std::span<const V> positions) {
  const Solid<V>& shape = solid.placed.solid();
  const bool is_convex = shape.is_convex();
  const auto longest = static_cast<Real>(kMostStretch * parts_->longest_m());
  gaps_.resize(positions.size());
  described_.resize(positions.size());
  Real lowest = std::numeric_limits<Real>::max();
  for (size_t i = 0; i < positions.size(); ++i) {
    described_[i] = solid.placed.DescribedAtStart(positions[i]);
    gaps_[i] = shape.At(described_[i]);
    lowest = std::min(lowest, gaps_[i].gap);
  }
  if (lowest > solid.reach + longest) return;
  for (uint32_t i = 0; i < positions.size(); ++i) {
    if (gaps_[i].gap > solid.reach || numbers_.inverse_masses[i] == 0) continue;
    solid.near.push_back(i);
    solid.near_travels.push_back(gaps_[i].gap);
  }
  const auto bound_of = [&](std::span<const uint32_t> corners) {
    Real bound = std::numeric_limits<Real>::lowest();
    for (const uint32_t i : corners) {
      Real its = gaps_[i].gap;
      for (const uint32_t j : corners) {
        if (i == j) continue;
        const V way = described_[j] - described_[i];
        its = std::min(its, gaps_[i].gap + (is_convex ? self_contact::Dot(gaps_[i].normal, way)
                                                      : -self_contact::Length(way)));
      }
      bound = std::max(bound, its);
      if (bound > solid.reach) break;
    }
    return bound;
  };
  const auto add = [&](std::span<const uint32_t> corners) {
    bool is_near = false;
    for (const uint32_t i : corners) is_near |= gaps_[i].gap <= solid.reach + longest;
    if (!is_near || solid.is_given_up) return;
    const Real bound = bound_of(corners);
    if (bound <= solid.reach) Add(solid, corners, bound);
  };
  SeldomInterruption interruption(numbers_.interruption);
  for (const auto& triangle : parts_->triangles()) {
    interruption.Check();
    add(triangle);
  }
  for (const auto& edge : parts_->edges()) {
    interruption.Check();
    add(edge);
  }
}

template <class V>
void SurfaceContacts<V>::Drop(std::vector<Contact>& contacts) {
  contact_count_ -= contacts.size();
  contacts.clear();
}

// For one more of these contacts of the solid. Where there is none it is given up, and none of them
// is left: where some are is chance.
template <class V>
bool SurfaceContacts<V>::HasRoom(SolidState& solid, std::vector<Contact>& contacts) {
  if (solid.is_given_up) return false;
  if (contact_count_ < numbers_.most_contacts) {
    ++contact_count_;
    return true;
  }
  Drop(contacts);
  contacts.shrink_to_fit();
  solid.is_given_up = has_given_up_ = true;
  return false;
}

// The particles of the candidates, which wait for their bounds.
template <class V>
void SurfaceContacts<V>::Watch(SolidState& solid, size_t particle_count) {
  constexpr uint32_t kNone = UINT32_MAX;
  watched_.assign(particle_count, kNone);
  for (const Contact& contact : solid.candidates) {
    for (uint32_t k = 0; k < contact.count; ++k) watched_[contact.particles[k]] = 0;
  }
  solid.watched.clear();
  solid.described.clear();
  for (uint32_t i = 0; i < particle_count; ++i) {
    if (watched_[i] == kNone) continue;
    watched_[i] = static_cast<uint32_t>(solid.watched.size());
    solid.watched.push_back(i);
    solid.described.push_back(described_[i]);
  }
  std::vector<typename Wakes<Real>::Corners> corners;
  for (const Contact& contact : solid.candidates) {
    const auto& [i, j, k] = contact.particles;
    corners.push_back({watched_[i], watched_[j], watched_[contact.count == 2 ? j : k]});
  }
  solid.wakes.Begin(static_cast<uint32_t>(solid.watched.size()), std::move(corners));
  for (size_t c = 0; c < bounds_.size(); ++c) solid.wakes.Wait(c, bounds_[c]);
}

template <class V>
void SurfaceContacts<V>::Add(SolidState& solid, std::span<const uint32_t> particles, Real bound) {
  Contact contact;
  contact.count = static_cast<uint32_t>(particles.size());
  contact.solid = static_cast<uint32_t>(&solid - solids_.data());
  Real inverse_mass = 0;
  for (size_t k = 0; k < particles.size(); ++k) {
    contact.particles[k] = particles[k];
    inverse_mass += numbers_.inverse_masses[particles[k]];
  }
  if (inverse_mass == 0) return;
  if (!HasRoom(solid, solid.candidates)) return bounds_.clear();
  solid.candidates.push_back(contact);
  bounds_.push_back(bound);
}

}  // namespace drape::surface_contact
