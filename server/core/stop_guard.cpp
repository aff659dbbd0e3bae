#include "server/core/stop_guard.h"

#include <spdlog/spdlog.h>

#include <cstdlib>

namespace drape {
namespace {

using std::chrono::milliseconds;

// Time between two checks.
constexpr milliseconds kPoll{20};

}  // namespace

StopGuard::StopGuard(const sigset_t& signals, milliseconds patience, int signals_left_out)
    : signals_(signals),
      deadline_(std::chrono::steady_clock::now() + patience),
      signals_left_out_(signals_left_out),
      thread_([this] { Watch(); }) {}

StopGuard::~StopGuard() {
  is_done_ = true;
  thread_.join();
}

void StopGuard::Extend(milliseconds patience) {
  const auto later = std::chrono::steady_clock::now() + patience;
  if (later > deadline_.load()) deadline_ = later;
}

void StopGuard::Watch() const {
  const timespec poll{0, std::chrono::nanoseconds(kPoll).count()};
  int left_out = 0;
  while (!is_done_) {
    const int signal = sigtimedwait(&signals_, nullptr, &poll);
    if (signal > 0 && ++left_out > signals_left_out_) {
      spdlog::error("failed reason=STOPPED_TWICE message=\"signal {} while draining\"", signal);
      std::_Exit(1);
    }
    if (std::chrono::steady_clock::now() >= deadline_.load()) {
      spdlog::error("failed reason=STOP_OVERDUE message=\"work under way does not end\"");
      std::_Exit(1);
    }
  }
}

}  // namespace drape
