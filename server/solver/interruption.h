// Where a stage of a step that takes long may stop.
#pragma once

#include <cstdint>

#include "server/solver/pause.h"

namespace drape {

// Thrown within a step that is left undone.
struct StepDropped {};

// Asked within a stage by the thread that leads the step. No result depends on what it does.
class Interruption {
 public:
  // May keep the calling thread for a while, or throw StepDropped.
  virtual void Check() = 0;

 protected:
  ~Interruption() = default;
};

// Drops the step as soon as a pause is due.
class DropWhenDue final : public Interruption {
 public:
  // `pause` outlives it.
  explicit DropWhenDue(const Pause& pause) : pause_(pause) {}

  void Check() override {
    if (pause_.IsDue()) throw StepDropped();
  }

 private:
  const Pause& pause_;
};

// Asks once in so many times: for loops whose bodies are short.
class SeldomInterruption {
 public:
  // Null: nobody is asked.
  explicit SeldomInterruption(Interruption* interruption) : interruption_(interruption) {}

  void Check() {
    if (--left_ > 0) return;
    left_ = kTimes;
    if (interruption_ != nullptr) interruption_->Check();
  }

 private:
  static constexpr uint32_t kTimes = 8192;  // a pair takes about a tenth of a microsecond

  Interruption* const interruption_;
  uint32_t left_ = kTimes;
};

}  // namespace drape
