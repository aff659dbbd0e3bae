// The colliders that a cloth can meet within a step. Contacts with the others would change nothing,
// so a step leaves them out; it watches where particles get, and is done again with all colliders
// if one gets farther than expected. The result is the same bit for bit.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// An axis-parallel box of places; to begin with it holds none.
struct ParticleBox {
  Vec4 low = Splat(std::numeric_limits<float>::infinity());
  Vec4 high = Splat(-std::numeric_limits<float>::infinity());

  void Add(Vec4 place) {
    low = Min(low, place);
    high = Max(high, place);
  }
  // All lanes are set if the place is in the box; what is not a number is not.
  Mask4 Holds(Vec4 place) const { return (place >= low) & (place <= high); }
};

// Looks whether particles stay in a box; one thread's.
class ReachWatch {
 public:
  ReachWatch(const ParticleBox& range, bool is_on) : range_(range), is_on_(is_on) {}
  void See(Vec4 place) {
    if (is_on_) is_held_ &= range_.Holds(place);
  }
  bool has_left() const { return IsAnyLaneSet(~is_held_); }

 private:
  const ParticleBox range_;
  const bool is_on_;
  Mask4 is_held_{-1, -1, -1, -1};
};

// The reach of one cloth in one step.
struct ColliderReach {
  std::vector<uint32_t> near;  // the colliders that the step works on, ascending
  bool has_far = false;        // others are left out: those that nothing in `range` touches
  ParticleBox range;           // only with has_far
  // Whether a contact that is left out would have been looked for outside the range: the step is to
  // be done again with all colliders.
  bool has_left = false;

  // Whether these are looked for at the end of every sweep, for a near collider may move a particle
  // away before the next one is looked at. Else, with one sweep and nothing near, particles are
  // where the substep ends.
  bool WatchesSweeps(uint32_t max_iterations) const {
    return has_far && (!near.empty() || max_iterations > 1);
  }
  bool WatchesEnds(uint32_t max_iterations) const {
    return has_far && !WatchesSweeps(max_iterations);
  }
};

}  // namespace drape::cpu
