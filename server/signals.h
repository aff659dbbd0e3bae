// The signals that draped takes: by sigtimedwait alone, in main.
#pragma once

#include <chrono>
#include <csignal>
#include <memory>

#include "server/api/authentication.h"
#include "server/config.h"
#include "server/core/stop_guard.h"
#include "server/scheduler/scheduler.h"

namespace drape {

// SIGINT and SIGTERM, which end the server.
sigset_t StopSignals();

// Blocks them in this thread and those that it starts, and the ones that ask for something else:
// SIGHUP, SIGUSR1 and SIGUSR2. Ignores SIGPIPE, of a log that nobody reads any more.
void TakeSignals();

// Until a signal ends the server; returns it. SIGUSR2 ends it as SIGTERM does, but may come again:
// an operator may ask twice, or a supervisor after him. SIGUSR1 asks for statistics. SIGHUP comes
// to servers that shall read their files again, and when a terminal is closed; neither ends this
// one. A token file that cannot be used leaves the tokens as they are, and certificates that cannot
// be used those before them, at which it looks every other second. `authentication`: null without
// tokens; `tls`: null without encryption.
int WaitForStop(const Config& config, Scheduler& scheduler, RateQuota& builder_rates,
                api::Authentication* authentication, api::TlsInUse* tls);

// Time for the last checkpoint of each session until the process counts as hanging.
constexpr std::chrono::milliseconds kWritePatience{60'000};

// Of a drain that this signal has begun. With checkpoints `hurry` is used when a signal to stop
// comes again, and only the next one ends the process: what is not yet written would be lost.
std::unique_ptr<StopGuard> GuardDrain(const Config& config, int signal, CancelToken hurry);

}  // namespace drape
