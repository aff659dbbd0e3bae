#include "tests/bench/stability/hang_guard.h"

#include <cstdio>
#include <cstdlib>

namespace drape::bench {
namespace {

std::chrono::steady_clock::time_point Later(std::chrono::duration<double> limit) {
  using Clock = std::chrono::steady_clock;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
}

}  // namespace

HangGuard::HangGuard(double limit_s)
    : limit_(limit_s), what_("the start"), deadline_(Later(limit_)), thread_([this] { Run(); }) {}

HangGuard::~HangGuard() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void HangGuard::Watch(const std::string& what) {
  const std::lock_guard lock(mutex_);
  what_ = what;
  deadline_ = Later(limit_);
}

void HangGuard::Run() {
  std::unique_lock lock(mutex_);
  while (!is_over_) {
    if (std::chrono::steady_clock::now() >= deadline_) {
      std::fprintf(stderr, "drape_bench: %s hangs: no end after %g s\n", what_.c_str(),
                   limit_.count());
      std::_Exit(2);
    }
    changed_.wait_until(lock, deadline_);
  }
}

}  // namespace drape::bench
