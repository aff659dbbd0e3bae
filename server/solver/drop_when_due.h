// Drops a step that takes longer than expected.
#pragma once

#include "server/core/interruption.h"
#include "server/solver/pause.h"

namespace drape {

// Stops it as soon as a pause is due.
class DropWhenDue final : public Interruption {
 public:
  // `pause` outlives it.
  explicit DropWhenDue(const Pause& pause) : pause_(pause) {}

  void Check() override {
    if (pause_.IsDue()) throw WorkStopped();
  }

 private:
  const Pause& pause_;
};

}  // namespace drape
