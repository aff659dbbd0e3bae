#include "server/solver/pausable_work.h"

#include <system_error>
#include <utility>

namespace drape {

std::unique_ptr<PausableWork> PausableWork::Begin(Work work) {
  try {
    return std::unique_ptr<PausableWork>(new PausableWork(std::move(work)));
  } catch (const std::system_error&) {
    return nullptr;
  }
}

PausableWork::PausableWork(Work work) : work_(std::move(work)), thread_([this] { Run(); }) {}

PausableWork::~PausableWork() {
  if (!is_over_) {
    is_dropped_ = true;
    may_work_.release();
  }
  thread_.join();
}

bool PausableWork::Continue(const Pause& pause) {
  pause_ = pause;
  may_work_.release();
  has_stopped_.acquire();
  if (failure_ != nullptr) std::rethrow_exception(failure_);
  return is_over_;
}

void PausableWork::Check() {
  if (!pause_.IsDue()) return;
  has_stopped_.release();
  may_work_.acquire();
  if (is_dropped_) throw WorkStopped();
}

void PausableWork::Run() {
  may_work_.acquire();
  if (is_dropped_) return;
  try {
    work_(*this, pause_);
  } catch (const WorkStopped&) {
    return;  // nobody waits
  } catch (...) {
    failure_ = std::current_exception();
  }
  is_over_ = true;
  has_stopped_.release();
}

}  // namespace drape
