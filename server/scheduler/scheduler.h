// The device thread, which owns the backend, with the queue in front of it and the completion
// thread behind it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>

#include "server/core/clock.h"
#include "server/core/duration_histogram.h"
#include "server/core/rate_quota.h"
#include "server/core/status.h"
#include "server/scheduler/command_queue.h"
#include "server/scheduler/observers.h"
#include "server/scheduler/step_work.h"
#include "server/solver/backend.h"

namespace drape {

// UNAVAILABLE, DRAINING: what is refused while the server shuts down.
Status DrainingStatus();

// Runs on the device thread; an error is what Scheduler::Start returns.
using BackendFactory = std::function<Result<std::unique_ptr<Backend>>()>;
struct SchedulerLimits {
  // Cloths stepped in one backend.Step. More: a large device is used better; fewer: sessions
  // interleave more finely.
  uint32_t max_cloths_per_batch = 16384;
  // What a batch may cost by what its cloths have cost so far [us]: all sessions wait for it. A
  // step that costs more is done alone, in pieces of this duration, and others are stepped between
  // them.
  int64_t batch_budget_us = 50'000;
  // Working memory of the steps that are done in pieces at the same time, as
  // Backend::LongStepBytes tells; one of them may have more.
  uint64_t max_long_step_bytes = uint64_t{1} << 30;
  // How long a batch may wait, after the answers of the last one, for sessions that came back that
  // quickly before; never longer than two batches take. 0: not at all.
  int64_t max_queue_delay_us = 10'000;
  // Step requests submitted and not yet ended, per session and in all.
  uint32_t max_queued_requests_per_session = 64;
  uint32_t max_queued_requests = 4096;
  // Commands posted and not yet run. A flood of creations must not fill the memory.
  uint32_t max_queued_commands = 4096;
  // Subscriptions, per session and in all. One counts until it has ended and its Observer is
  // destroyed.
  uint32_t max_observers_per_session = 32;
  uint32_t max_observers = 1024;
  // Calls of ReadStates that wait or whose states are still held, per session and in all.
  uint32_t max_reads_in_flight_per_session = 4;
  uint32_t max_reads_in_flight = 1024;
  // Limit of one step request; until_step may not lie further ahead. Bounds how long it can run.
  uint32_t max_steps_per_request = 1000000;
  // Suggested to clients that were refused because of a limit [ms].
  int64_t retry_after_ms = 50;
};

// Since the start, except those marked "now".
struct SchedulerCounters {
  uint64_t rounds = 0;              // batches
  uint64_t dispatches = 0;          // sum of BatchReport::dispatch_count
  uint64_t cloth_steps = 0;         // completed
  uint64_t cloth_steps_asleep = 0;  // completed without being computed (sleep_watch.h)
  uint64_t faults = 0;
  uint64_t long_step_pieces = 0;
  DurationHistogram::Counts batch_durations;    // pieces included
  DurationHistogram::Counts request_durations;  // from Submit to the end
  uint32_t queued_requests = 0;                 // now: step requests submitted and not yet ended
  uint32_t queued_commands = 0;                 // now
  uint64_t frames_sent = 0;                     // to subscriptions
  uint64_t frames_dropped = 0;                  // due, but their clients gave no credit
  uint64_t slow_consumers = 0;                  // subscriptions that ended for it
};

// Step requests submitted and not yet ended.
struct QueuedRequests {
  std::unordered_map<std::string, uint32_t> by_session;
  std::unordered_map<std::string, uint32_t> by_owner;  // StepWork::owner
};

// Thread-safe unless a method says otherwise. Methods never wait for the device unless they say so.
//
// Order: the commands of one owner are run in that order, before the requests that came with them
// unless the commands of a round take too long together. A command that is posted while a request
// runs takes effect between two of its steps.
class Scheduler {
 public:
  // Starts the threads and waits for the factory. `clock` must outlive the scheduler.
  static Result<std::unique_ptr<Scheduler>> Start(BackendFactory factory,
                                                  const SchedulerLimits& limits,
                                                  const Clock& clock);
  // Drain(0).
  ~Scheduler();
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  const BackendDescription& description() const;
  const SchedulerLimits& limits() const;

  // For commands that a client's request caused. UNAVAILABLE (DRAINING) or RESOURCE_EXHAUSTED
  // (QUEUE_FULL): the command is dropped. An accepted command is always run.
  // `owner`: the tenant, or without tenants the session; owners take turns, and their places are
  // limited by what is free.
  Status Post(const std::string& owner, DeviceCommand command);
  // For commands that free something or continue what was begun: ignores the limits. False after
  // Drain: the backend and all its cloths are destroyed; the command is dropped.
  [[nodiscard]] bool PostCleanup(const std::string& owner, DeviceCommand command);
  // Device thread, in a command of this owner: what follows it, in the next round, before all other
  // commands of the owner. So work in slices is done as one, as far as the owner can see.
  void Continue(const std::string& owner, DeviceCommand command);
  // PostCleanup, but before the other commands of the owner that wait, and never within such work.
  [[nodiscard]] bool PostFirst(const std::string& owner, DeviceCommand command);
  // PostCleanup, then waits for the result. Not on the device or the completion thread.
  Status RunBlocking(std::function<Status(Backend&)> command);
  // Runs `function` on the completion thread, after all earlier ones. For the answers of commands.
  // After Drain it runs at once on the caller's thread.
  void Complete(std::function<void()> function);

  // Queues a step request. An error means that `done` will not be called: UNAVAILABLE (DRAINING),
  // RESOURCE_EXHAUSTED (QUEUE_FULL, with retry_after).
  //
  // A request starts when no earlier request that is still running names one of its cloths. Then
  // its expectations are checked and its controls take effect, and each of its cloths takes part in
  // one batch per step, together with the cloths of all other requests that can run. All requests
  // that wait when a round begins share one backend.Step, up to max_cloths_per_batch and
  // batch_budget_us. A round of new requests only may wait for more, see max_queue_delay_us.
  Status Submit(StepWork work);

  // Reads states between two rounds, those of very many cloths in slices, between which others are
  // stepped (sliced_read.h); `done` on the completion thread: NOT_FOUND (CLOTH_NOT_FOUND)
  // if one of the cloths was deleted. Errors as for Post, and RESOURCE_EXHAUSTED (TOO_MANY_READS,
  // with retry_after): a read counts until the states (or their `in_flight`) are dropped.
  // `session`, `tenant`: as in StepWork; no session: only the limit in all applies. With `cancel`
  // used before its turn nothing is read: CANCELLED.
  Status ReadStates(std::vector<std::shared_ptr<ClothRuntime>> cloths, const StateFields& fields,
                    std::function<void(Result<ClothStates>)> done, const std::string& session = {},
                    const std::string& tenant = {}, const CancelToken& cancel = {});

  // ReadStates for a picture, of whole cloths: `fields` names no particles. `done` on the DEVICE
  // thread: it must only pass the states on. `on_device`: the caller accepts a copy that stays on
  // the device (ClothStates::on_device).
  Status ReadForDrawing(std::vector<std::shared_ptr<ClothRuntime>> cloths,
                        const StateFields& fields, bool on_device,
                        std::function<void(Result<ClothStates>)> done, const std::string& session,
                        const std::string& tenant = {}, const CancelToken& cancel = {});

  // Starts a subscription; see ObserverSpec. Errors as for Post, and RESOURCE_EXHAUSTED
  // (TOO_MANY_SUBSCRIPTIONS).
  Result<std::shared_ptr<Observer>> Subscribe(ObserverSpec spec);
  // A place among the subscriptions, for what else lasts as they do; kept as long as the pointer.
  Result<std::shared_ptr<void>> TakeSubscription(const std::string& session,
                                                 const std::string& tenant);

  // Refuses new work, runs accepted work for at most `grace_us` of the clock, then ends the rest
  // with UNAVAILABLE (DRAINING), destroys the backend on the device thread, and waits until the
  // last completion has run. Not on the device or the completion thread. A second call does
  // nothing. `last` is run before the backend is destroyed, when nothing is under way any longer.
  // `hurry`: used at any time, also before, it ends the grace within DeviceLoop::kLook_us.
  void Drain(int64_t grace_us, DeviceCommand last = {}, const CancelToken& hurry = {});
  bool is_draining() const;

  SchedulerCounters counters() const;
  QueuedRequests queued_requests() const;
  // Without limits until somebody sets them.
  RateQuota& rates();

  // Tests only: the device thread does nothing, not even commands, until released. Returns when the
  // current round is over. Drain releases.
  void HoldForTest();
  void ReleaseForTest();

 private:
  class Core;
  struct ReadUnderWay;
  explicit Scheduler(std::shared_ptr<Core> core);
  static void ContinueRead(const std::shared_ptr<ReadUnderWay>& call, Backend& backend);
  std::shared_ptr<Core> core_;
};

}  // namespace drape
