#include "server/signals.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/api/accept_guard.h"
#include "server/wiring.h"

namespace drape {
namespace {

constexpr time_t kLookPeriod_s = 2;
constexpr uint64_t kLooksPerStatistics = 5;
// Time after the grace of a drain until the process counts as hanging.
constexpr std::chrono::milliseconds kStopPatience{5'000};

// A file that cannot be used leaves the tokens as they are.
void ReloadTokens(const Config& config, Scheduler& scheduler, RateQuota& builder_rates,
                  api::Authentication* authentication) {
  if (authentication == nullptr || !authentication->has_tokens()) {
    return spdlog::info(
        "signal_ignored signal=SIGHUP reason=\"there is no token file; TLS files are read again by "
        "themselves\"");
  }
  Result<api::TokenFile> tokens = api::TokenFile::Read(config.token_file);
  if (!tokens.ok()) {
    return spdlog::error("tokens_kept message=\"{}\"", tokens.status().message());
  }
  spdlog::info("tokens_read count={}", tokens->token_count());
  authentication->Replace(std::move(tokens).value());
  SetRates(config, authentication, scheduler.rates(), builder_rates);
}

void LookAtTlsFiles(api::TlsInUse& tls) {
  const std::optional<Status> status = tls.Look();
  if (!status) return;
  if (status->ok()) return spdlog::info("tls_files_good_again");
  spdlog::error("tls_files_bad message=\"{}; those before stay in use\"", status->message());
}

// Those, and the ones that ask for something else.
sigset_t AwaitedSignals() {
  sigset_t signals = StopSignals();
  sigaddset(&signals, SIGHUP);
  sigaddset(&signals, SIGUSR1);
  sigaddset(&signals, SIGUSR2);
  return signals;
}

void LogStatistics(spdlog::level::level_enum level, const Scheduler& scheduler) {
  const SchedulerCounters counters = scheduler.counters();
  spdlog::log(
      level,
      "statistics rounds={} dispatches={} cloth_steps={} asleep={} faults={} queued_requests={} "
      "refused_connections={}",
      counters.rounds, counters.dispatches, counters.cloth_steps, counters.cloth_steps_asleep,
      counters.faults, counters.queued_requests, api::RefusedConnections());
}

}  // namespace

sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

void TakeSignals() {
  const sigset_t awaited = AwaitedSignals();
  pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

int WaitForStop(const Config& config, Scheduler& scheduler, RateQuota& builder_rates,
                api::Authentication* authentication, api::TlsInUse* tls) {
  const sigset_t signals = AwaitedSignals();
  const timespec period{kLookPeriod_s, 0};
  for (uint64_t looks = 1;; ++looks) {
    const int signal = sigtimedwait(&signals, nullptr, &period);
    if (signal == SIGINT || signal == SIGTERM || signal == SIGUSR2) return signal;
    if (signal == SIGHUP) ReloadTokens(config, scheduler, builder_rates, authentication);
    if (tls != nullptr) LookAtTlsFiles(*tls);
    if (signal == SIGUSR1) LogStatistics(spdlog::level::info, scheduler);
    if (looks % kLooksPerStatistics == 0) LogStatistics(spdlog::level::debug, scheduler);
  }
}

std::unique_ptr<StopGuard> GuardDrain(const Config& config, int signal, CancelToken hurry) {
  std::chrono::milliseconds patience(config.drain_grace_ms);
  patience += kStopPatience;
  std::function<void()> be_quick;
  if (!config.checkpoints.folder.empty()) {
    patience += kWritePatience;
    be_quick = [hurry]() mutable { hurry.Cancel(); };
  }
  const int signals_left_out = signal == SIGUSR2 ? 1 : 0;  // a supervisor's, after the operator's
  return std::make_unique<StopGuard>(StopSignals(), patience, signals_left_out, be_quick);
}

}  // namespace drape
