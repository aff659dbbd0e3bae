// How much the searches for what touches may look at.
#pragma once

#include <algorithm>
#include <cstddef>

#include "server/core/interruption.h"
#include "server/solver/self_contact/contact_surface.h"

namespace drape::self_contact {

// A search costs what it looks at: where everything is in one place, that is all pairs there are,
// and a single step would keep the device from all others for minutes. What is looked at is
// counted, not timed, so a step does not depend on the machine. One thread.
class SearchBudget {
 public:
  // `interruption`: asked now and then; null: nobody is.
  explicit SearchBudget(size_t looks, Interruption* interruption = nullptr)
      : left_(looks), interruption_(interruption) {
    SetNextCheck();
  }

  void Take(size_t looks) {
    left_ -= std::min(looks, left_);
    if (left_ < next_check_) Check();
  }
  bool is_spent() const { return left_ == 0; }
  // Asks now, where something takes long that nothing is looked at for.
  void Check() {
    SetNextCheck();
    Ask(interruption_);
  }

 private:
  static constexpr size_t kBetweenChecks = size_t{1} << 20;  // a millisecond

  void SetNextCheck() {
    next_check_ = interruption_ == nullptr ? 0 : left_ - std::min(left_, kBetweenChecks);
  }

  size_t left_;
  size_t next_check_;  // when less is left
  Interruption* interruption_;
};

// One look is what two boxes cost that are not near each other, about 1 ns. In looks:
inline constexpr size_t kNodePairLooks = 8;   // two nodes of the tree
inline constexpr size_t kDistanceLooks = 32;  // the distance of two primitives
inline constexpr size_t kCrossLooks = 16;     // whether an edge crosses a triangle
inline constexpr size_t kExactLooks = 256;    // a sign of that which rounding hides

// Of the searches of one substep: more than cloth in a heap needs
// (tests/bench/notes/self_contact.md).
inline SearchBudget SubstepBudget(const ContactSurface& surface,
                                  Interruption* interruption = nullptr) {
  constexpr size_t kOfSmallCloth = size_t{1} << 26, kPerParticle = 32768;
  return SearchBudget(std::max(kOfSmallCloth, kPerParticle * surface.particle_count()),
                      interruption);
}

// Of a search for crossings, once a step where something may cross; and of each of the two searches
// for a report.
inline SearchBudget ReportBudget(const ContactSurface& surface,
                                 Interruption* interruption = nullptr) {
  constexpr size_t kOfSmallCloth = size_t{1} << 26, kPerParticle = 4096;
  return SearchBudget(std::max(kOfSmallCloth, kPerParticle * surface.particle_count()),
                      interruption);
}

}  // namespace drape::self_contact
