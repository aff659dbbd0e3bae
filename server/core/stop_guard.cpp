#include "server/core/stop_guard.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <utility>

namespace drape {
namespace {

using std::chrono::milliseconds;

// Time between two checks.
constexpr milliseconds kPoll{20};

}  // namespace

StopGuard::StopGuard(const sigset_t& signals, milliseconds patience, int signals_left_out,
                     std::function<void()> hurry)
    : signals_(signals),
      deadline_(std::chrono::steady_clock::now() + patience),
      signals_left_out_(signals_left_out),
      hurry_(std::move(hurry)),
      told_at_(std::chrono::steady_clock::now()),
      thread_([this] { Watch(); }) {}

StopGuard::~StopGuard() {
  is_done_ = true;
  thread_.join();
}

void StopGuard::Extend(milliseconds patience) {
  const auto later = std::chrono::steady_clock::now() + patience;
  if (later > deadline_.load()) deadline_ = later;
}

void StopGuard::Take(int signal) {
  const auto now = std::chrono::steady_clock::now();
  const bool is_repetition = signals_left_out_ == 0 && now - told_at_ < kRepetition;
  if (is_repetition) return spdlog::info("signal_ignored signal={} repeated=true", signal);
  told_at_ = now;
  if (signals_left_out_ > 0) {
    --signals_left_out_;
  } else if (const auto hurry = std::exchange(hurry_, {})) {
    spdlog::warn("draining_at_once signal={}", signal);
    hurry();
  } else {
    spdlog::error("failed reason=STOPPED_TWICE message=\"signal {} while draining\"", signal);
    std::_Exit(1);
  }
}

void StopGuard::Watch() {
  const timespec poll{0, std::chrono::nanoseconds(kPoll).count()};
  while (!is_done_) {
    const int signal = sigtimedwait(&signals_, nullptr, &poll);
    if (signal > 0) Take(signal);
    if (std::chrono::steady_clock::now() >= deadline_.load()) {
      spdlog::error("failed reason=STOP_OVERDUE message=\"work under way does not end\"");
      std::_Exit(1);
    }
  }
}

}  // namespace drape
