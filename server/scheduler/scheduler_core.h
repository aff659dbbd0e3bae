// The inside of the scheduler: queue, device thread, drain. Only scheduler.cpp includes this.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <future>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/core/session_permits.h"
#include "server/scheduler/command_queue.h"
#include "server/scheduler/completion_queue.h"
#include "server/scheduler/device_loop.h"
#include "server/scheduler/gathering.h"
#include "server/scheduler/observers.h"
#include "server/scheduler/scheduler.h"

namespace drape {

// Any thread unless stated otherwise; methods as in Scheduler.
class Scheduler::Core {
 public:
  Core(const SchedulerLimits& limits, const Clock& clock);

  // Once, before anything else. After an error only the destructor may be called.
  Status Start(BackendFactory factory);
  Status Post(const std::string& owner, DeviceCommand command);
  bool PostCleanup(const std::string& owner, DeviceCommand command);
  bool PostFirst(const std::string& owner, DeviceCommand command);
  void Continue(const std::string& owner, DeviceCommand command);
  Status Submit(StepWork work);
  void Drain(int64_t grace_us, DeviceCommand last, const CancelToken& hurry);
  void Hold();
  void Release();
  // Makes the device thread serve its subscriptions.
  void Wake();

  bool is_draining() const;
  SchedulerCounters counters() const;
  QueuedRequests queued_requests() const;
  const BackendDescription& description() const { return description_; }
  const SchedulerLimits& limits() const { return limits_; }
  CompletionQueue& completions() { return completions_; }
  SessionPermits& observer_permits() { return observer_permits_; }
  SessionPermits& read_permits() { return read_permits_; }
  RateQuota& rates() { return rates_; }
  bool IsOnOwnThread() const {
    return std::this_thread::get_id() == device_thread_id_ || completions_.IsOnThread();
  }
  // Device thread.
  ObserverSet& observers() { return observers_; }

 private:
  struct Submission {
    StepWork work;
    int64_t submitted_us = 0;
  };
  // The work that the device thread takes over at the beginning of a round, beside commands; none
  // while the next batch waits for more requests.
  struct Inbox {
    std::deque<Submission> submissions;
    bool is_last = false;  // nothing will follow: end the rest and stop
  };

  void DeviceThread(const BackendFactory& factory, std::promise<Status>& started);
  void RunRounds(Backend& backend);
  // Those that wait, in turns, for about the time of a batch.
  void RunCommands(Backend& backend);
  // What the device thread has to do besides the inbox.
  struct Load {
    bool has_requests = false;
    bool is_busy = false;               // a round makes progress now
    std::optional<int64_t> wake_at_us;  // by the clock, when there may be something to do
  };
  // Waits until there is something to do, or until `load.wake_at_us`.
  Inbox TakeInbox(const Load& load);
  void EndRequest(StepWork work, StepOutcome outcome);
  // Gives the answer to a request. `is_idle`: the device thread has nothing else to do.
  void Give(StepWork work, StepOutcome outcome, bool is_idle);
  // Whether answers that stayed behind may wait for the next batch: it comes at once, and nothing
  // would overtake them. A session with nothing else under way is answered at once: it may be about
  // to come back, and batches wait for such sessions (Gathering).
  bool MayAnswersWait(const DeviceLoop& loop, bool is_busy) const;

  // --- With mutex_ held.

  // Somebody asks for something. Whether somebody else has, just now.
  void See(const std::string& owner, int64_t now_us);
  bool HasSeenOthers(const std::string& owner, int64_t now_us) const;
  std::optional<CommandQueue::Entry> NextCommand();
  // A command is over that took so long.
  void EndCommand(const std::string& owner, int64_t took_us);
  // Returns when there is work, or at that time by the clock.
  void WaitForWork(std::unique_lock<std::mutex>& lock, const Load& load);
  bool HasWork(const Load& load) const;
  // Returns when notified, or at that time; none: only when notified. Unlocks meanwhile.
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;
  void Sleep(std::unique_lock<std::mutex>& lock, const Deadline& until);
  // Wakes the device thread, whether it sleeps or spins. With mutex_ held.
  void Notify();
  // Returns when notified, or at that time by the clock, without sleeping. Unlocks meanwhile.
  void SpinForNews(std::unique_lock<std::mutex>& lock, int64_t until_us);
  // Whether the waiting submissions need not wait for more of them.
  bool IsBatchDue(bool is_busy) const;
  bool IsAtTheEnd(bool has_requests) const;

  const SchedulerLimits limits_;
  const Clock& clock_;
  BackendDescription description_;    // constant after Start
  std::thread::id device_thread_id_;  // constant after Start
  CompletionQueue completions_;
  RoundCounters round_counters_;
  RateQuota rates_;
  SessionPermits observer_permits_;
  SessionPermits read_permits_;
  ObserverSet observers_;  // device thread

  mutable std::mutex mutex_;
  std::condition_variable wake_;    // for the device thread
  std::atomic<uint64_t> news_{0};   // number of notifications
  std::condition_variable parked_;  // for Hold
  CommandQueue commands_;
  // The last who asked for something, and the last before it who was another one.
  struct Asked {
    std::string owner;
    int64_t at_us = std::numeric_limits<int64_t>::min() / 2;
  };
  Asked last_asked_, asked_before_;
  std::deque<Submission> submissions_;
  QueuedRequests requests_;
  uint32_t request_count_ = 0;
  Gathering gathering_;
  bool is_woken_ = false;
  bool is_held_ = false;
  bool is_parked_ = false;  // the device thread waits
  bool is_draining_ = false;
  int64_t drain_deadline_us_ = 0;
  CancelToken hurry_;  // the deadline is now
  DeviceCommand last_command_;
  bool is_stopped_ = false;  // the device thread takes nothing more

  std::mutex drain_mutex_;  // one Drain at a time
  std::thread device_thread_;
};

}  // namespace drape
