// Where a step that is done in pieces pauses between its dispatches.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "server/gl/context.h"
#include "server/solver/gl_compute/tiled_step.h"
#include "server/solver/pause.h"

namespace drape {

// Of one piece. A step is a sequence of sections, each of which makes the same dispatches whenever
// it is run.
class DispatchPauses {
 public:
  DispatchPauses(TiledProgress& progress, const Pause& pause)
      : progress_(progress), pause_(pause) {}

  // Makes the dispatches of a section that have not been made yet. False: it paused before one of
  // them. `section` always runs to its end, whatever of it is left: what it tells the kernels is
  // told again in each piece.
  template <class Function>
  bool DoSection(Function section) {
    begun_ = 0;
    is_left_ = false;
    section();
    progress_.dispatches_done = is_left_ ? begun_ : 0;
    return !is_left_;
  }

  // Whether the next dispatch of the section is to be made now.
  bool MayDispatch() {
    is_left_ |= is_due_;
    return !is_due_ && ++begun_ > progress_.dispatches_done;
  }

  // It was made. Looks whether to pause, once the device has done what it was given.
  void EndDispatch() {
    uint32_t& per_look = progress_.dispatches_per_look;
    if (pause_.is_never() || ++since_look_ < per_look) return;
    glFinish();
    const auto now = Clock::now();
    const auto took = now - last_look_;
    if (took < kShortLook) per_look = std::min(2 * per_look, kMostPerLook);
    if (took > kLongLook) per_look = std::max(per_look / 2, 1u);
    last_look_ = now;
    since_look_ = 0;
    is_due_ = pause_.IsDue();
  }

 private:
  using Clock = std::chrono::steady_clock;
  // Between two looks whether a pause is due: a wait for the device takes some 0.05 ms, a batch of
  // others 50 ms.
  static constexpr std::chrono::microseconds kShortLook{2'000};
  static constexpr std::chrono::microseconds kLongLook{8'000};
  static constexpr uint32_t kMostPerLook = 256;

  TiledProgress& progress_;
  const Pause& pause_;
  uint32_t begun_ = 0;    // of the section, with those of earlier pieces
  bool is_left_ = false;  // some of the section are for later pieces
  bool is_due_ = false;
  uint32_t since_look_ = 0;
  Clock::time_point last_look_ = Clock::now();
};

}  // namespace drape
