#include "server/core/stop_guard.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <thread>

namespace drape {
namespace {

using std::chrono::milliseconds;

// Also lets the log go to stderr, where a death test looks.
sigset_t BlockedStopSignals() {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "stop_guard_test", std::make_shared<spdlog::sinks::stderr_sink_mt>()));
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// After which a signal is another one.
constexpr milliseconds kAgain = StopGuard::kRepetition + milliseconds(100);

void Hang() {
  while (true) std::this_thread::sleep_for(milliseconds(10));
}

TEST(StopGuardDeathTest, EndsAProcessThatHangs) {
  EXPECT_EXIT(
      {
        const StopGuard guard(BlockedStopSignals(), milliseconds(50));
        Hang();
      },
      testing::ExitedWithCode(1), "STOP_OVERDUE");
}

TEST(StopGuardDeathTest, EndsAProcessThatIsToldTwice) {
  EXPECT_EXIT(
      {
        const StopGuard guard(BlockedStopSignals(), std::chrono::hours(1));
        std::this_thread::sleep_for(kAgain);
        kill(getpid(), SIGTERM);
        Hang();
      },
      testing::ExitedWithCode(1), "STOPPED_TWICE");
}

TEST(StopGuardDeathTest, ASignalThatIsSentTwiceIsOne) {
  EXPECT_EXIT(
      {
        const StopGuard guard(BlockedStopSignals(), std::chrono::hours(1));
        kill(getpid(), SIGTERM);
        std::this_thread::sleep_for(milliseconds(200));
        std::_Exit(7);
      },
      testing::ExitedWithCode(7), "signal_ignored");
}

TEST(StopGuardDeathTest, HurriesBeforeItEndsTheProcess) {
  EXPECT_EXIT(
      {
        std::atomic<bool> is_hurried = false;
        const StopGuard guard(BlockedStopSignals(), std::chrono::hours(1), 0,
                              [&] { is_hurried = true; });
        kill(getpid(), SIGTERM);
        std::this_thread::sleep_for(kAgain);
        if (is_hurried) std::_Exit(7);
        kill(getpid(), SIGTERM);
        std::this_thread::sleep_for(milliseconds(100));
        kill(getpid(), SIGTERM);  // the same
        std::this_thread::sleep_for(kAgain);
        if (!is_hurried) std::_Exit(8);
        kill(getpid(), SIGTERM);
        Hang();
      },
      testing::ExitedWithCode(1), "draining_at_once(.|\n)*STOPPED_TWICE");
}

TEST(StopGuardDeathTest, LeavesOutTheFirst) {
  EXPECT_EXIT(
      {
        const StopGuard guard(BlockedStopSignals(), std::chrono::hours(1), 1);
        std::this_thread::sleep_for(kAgain);
        kill(getpid(), SIGTERM);
        std::this_thread::sleep_for(milliseconds(100));
        kill(getpid(), SIGTERM);  // the same
        std::this_thread::sleep_for(milliseconds(100));
        std::_Exit(7);
      },
      testing::ExitedWithCode(7), "");
}

TEST(StopGuardDeathTest, WaitsForWorkThatGoesOn) {
  EXPECT_EXIT(
      {
        StopGuard guard(BlockedStopSignals(), milliseconds(50));
        guard.Extend(std::chrono::hours(1));
        guard.Extend(milliseconds(1));  // no earlier
        std::this_thread::sleep_for(milliseconds(200));
        std::_Exit(7);
      },
      testing::ExitedWithCode(7), "");
}

TEST(StopGuardDeathTest, DoesNothingOnceAllIsDone) {
  EXPECT_EXIT(
      {
        { const StopGuard guard(BlockedStopSignals(), milliseconds(50)); }
        std::this_thread::sleep_for(milliseconds(200));
        std::_Exit(7);
      },
      testing::ExitedWithCode(7), "");
}

}  // namespace
}  // namespace drape
