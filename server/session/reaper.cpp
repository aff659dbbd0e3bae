#include "server/session/reaper.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/core/memory_reserve.h"

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

void Reaper::LookAtMemory() {
  const bool is_there = MemoryReserve::Renew();
  const uint64_t times = MemoryReserve::times_used();
  if (times == std::exchange(seen_times_, times)) return;
  spdlog::warn("memory_short reserve_given_up={} is_there_again={}", times, is_there);
}

void Reaper::Loop(std::chrono::milliseconds interval) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, interval, [this] { return is_stopping_; })) {
    lock.unlock();
    registry_.ReapExpired();
    LookAtMemory();
    lock.lock();
  }
}

}  // namespace drape
