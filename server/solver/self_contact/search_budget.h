// How much the searches for what touches may look at.
#pragma once

#include <algorithm>
#include <cstddef>

#include "server/solver/self_contact/contact_surface.h"

namespace drape::self_contact {

// A search costs what it looks at: where everything is in one place, that is all pairs there are,
// and a single step would keep the device from all others for minutes. What is looked at is
// counted, not timed, so a step does not depend on the machine. One thread.
class SearchBudget {
 public:
  explicit SearchBudget(size_t looks) : left_(looks) {}

  void Take(size_t looks) { left_ -= std::min(looks, left_); }
  bool is_spent() const { return left_ == 0; }

 private:
  size_t left_;
};

// One look is what two boxes cost that are not near each other, about 1 ns. In looks:
inline constexpr size_t kNodePairLooks = 8;   // two nodes of the tree
inline constexpr size_t kDistanceLooks = 32;  // the distance of two primitives
inline constexpr size_t kCrossLooks = 16;     // whether an edge crosses a triangle
inline constexpr size_t kExactLooks = 256;    // a sign of that which rounding hides

// Of the searches of one substep: more than cloth in a heap needs
// (tests/bench/notes/self_contact.md).
inline SearchBudget SubstepBudget(const ContactSurface& surface) {
  constexpr size_t kOfSmallCloth = size_t{1} << 26, kPerParticle = 32768;
  return SearchBudget(std::max(kOfSmallCloth, kPerParticle * surface.particle_count()));
}

// Of a search for crossings, once a step where something may cross; and of each of the two searches
// for a report.
inline SearchBudget ReportBudget(const ContactSurface& surface) {
  constexpr size_t kOfSmallCloth = size_t{1} << 26, kPerParticle = 4096;
  return SearchBudget(std::max(kOfSmallCloth, kPerParticle * surface.particle_count()));
}

}  // namespace drape::self_contact
