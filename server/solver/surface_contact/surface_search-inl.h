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
  DropParts(solid);
  solid.near.clear();
  solid.near_travels.clear();
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
  solid.triangle_count = corners_.size();
  for (const auto& edge : parts_->edges()) {
    interruption.Check();
    add(edge);
  }
}

template <class V>
void SurfaceContacts<V>::DropParts(SolidState& solid) {
  contact_count_ -= solid.places.size();
  solid.places.clear();
  solid.contacts.clear();
  solid.triangle_count = 0;
  corners_.clear();
  bounds_.clear();
}

template <class V>
void SurfaceContacts<V>::DropPassing(SolidState& solid) {
  contact_count_ -= solid.passing.size();
  solid.passing.clear();
}

// For one more part or passing one of the solid. Where there is none it is given up, and its caller
// drops all of them: where some are is chance. With their memory: other solids may fill as much.
template <class V>
bool SurfaceContacts<V>::HasRoom(SolidState& solid) {
  if (solid.is_given_up) return false;
  if (contact_count_ < numbers_.most_contacts) {
    ++contact_count_;
    return true;
  }
  solid.is_given_up = has_given_up_ = true;
  return false;
}

// The particles of the parts, which wait for their bounds.
template <class V>
void SurfaceContacts<V>::Watch(SolidState& solid, size_t particle_count) {
  constexpr uint32_t kUnwatched = UINT32_MAX;
  watched_.assign(particle_count, kUnwatched);
  for (const auto& its : corners_) {
    for (const uint32_t i : its) watched_[i] = 0;
  }
  solid.watched.clear();
  solid.described.clear();
  for (uint32_t i = 0; i < particle_count; ++i) {
    if (watched_[i] == kUnwatched) continue;
    watched_[i] = static_cast<uint32_t>(solid.watched.size());
    solid.watched.push_back(i);
    solid.described.push_back(described_[i]);
  }
  for (auto& its : corners_) {
    for (uint32_t& i : its) i = watched_[i];
  }
  solid.wakes.Begin(static_cast<uint32_t>(solid.watched.size()), std::move(corners_));
  for (size_t part = 0; part < bounds_.size(); ++part) solid.wakes.Wait(part, bounds_[part]);
}

// An edge has its second end twice.
template <class V>
void SurfaceContacts<V>::Add(SolidState& solid, std::span<const uint32_t> particles, Real bound) {
  Real inverse_mass = 0;
  for (const uint32_t i : particles) inverse_mass += numbers_.inverse_masses[i];
  if (inverse_mass == 0) return;
  if (!HasRoom(solid)) {
    DropParts(solid);
    solid.places.shrink_to_fit();
    solid.contacts.shrink_to_fit();
    return;
  }
  solid.places.push_back(SolidState::kNone);
  corners_.push_back({particles.front(), particles[1], particles.back()});
  bounds_.push_back(bound);
}

}  // namespace drape::surface_contact
