// A stretch of a step in parts, between which it may pause.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "server/solver/pause.h"

namespace drape::reference {

// The function that does a stretch runs to its end in every piece, whatever of it is left, and
// gives each part to Do: which ones there are must depend on nothing that the parts change. What
// they find out is kept outside of it.
class Parts {
 public:
  // `done`: parts of the stretch that earlier pieces have done.
  Parts(uint32_t done, const Pause& pause) : done_(done), pause_(pause) {}

  // The next part, if its turn has come.
  template <class Function>
  void Do(Function part) {
    if (is_due_ || begun_ < done_) {
      (is_due_ ? left_ : begun_) += 1;
      return;
    }
    ++begun_;
    part();
    is_due_ = pause_.IsDue();
  }
  // part(begin, end) for consecutive ranges of so many that cover [0, count).
  template <class Function>
  void DoRanges(uint32_t count, uint32_t per_part, Function part) {
    for (uint32_t begin = 0; begin < count; begin += std::min(per_part, count - begin)) {
      Do([&] { part(begin, begin + std::min(per_part, count - begin)); });
    }
  }

  bool is_complete() const { return left_ == 0; }
  // For the next piece.
  uint32_t done() const { return is_complete() ? 0 : begun_; }

 private:
  const uint32_t done_;
  const Pause& pause_;
  uint32_t begun_ = 0;  // with those of earlier pieces
  uint32_t left_ = 0;   // for later ones
  bool is_due_ = false;
};

// Does what is left of a stretch, of which `progress` keeps how far it is. False: paused.
template <class Progress, class Function>
bool DoParts(Progress& progress, const Pause& pause, Function stretch) {
  Parts parts(progress.parts_done, pause);
  stretch(parts);
  progress.parts_done = parts.done();
  return parts.is_complete();
}

}  // namespace drape::reference
