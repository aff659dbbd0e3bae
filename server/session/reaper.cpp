#include "server/session/reaper.h"

namespace drape {

Reaper::Reaper(SessionRegistry& registry, std::chrono::milliseconds interval)
    : registry_(registry), thread_([this, interval] { Loop(interval); }) {}

Reaper::~Reaper() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Reaper::Loop(std::chrono::milliseconds interval) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, interval, [this] { return is_stopping_; })) {
    lock.unlock();
    registry_.ReapExpired();
    lock.lock();
  }
}

}  // namespace drape
