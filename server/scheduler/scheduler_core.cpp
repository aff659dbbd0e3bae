#include "server/scheduler/scheduler_core.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <utility>

#include "server/core/check.h"
#include "server/core/trace.h"

namespace drape {
namespace {

// Shortest sleep while a subscription waits for its rate limit [us]; it also bounds how often the
// clock is read if it is advanced by hand or the time has just passed.
constexpr int64_t kMinWait_us = 1000;

// How many times as long as its command took an owner rests. More: the long waits of others are
// fewer among their short ones; fewer: what takes long is done sooner.
constexpr int64_t kRests = 4;

// Who asked for something so long ago may be about to ask again.
constexpr int64_t kJustNow_us = 200'000;

// Limits of an answer that the device thread gives itself: writing more positions takes over 0.1
// ms, and more reports take longer than waking a thread.
constexpr size_t kMaxParticlesGivenAtOnce = size_t{1} << 16;
constexpr size_t kMaxClothsGivenAtOnce = 1024;

bool IsShort(const StepWork& work, const StepOutcome& outcome) {
  if (work.cloths.size() > kMaxClothsGivenAtOnce) return false;
  if (!outcome.states.has_value()) return true;
  size_t particles = 0;
  for (const auto& cloth : work.cloths) particles += work.view.RowsOf(cloth->particle_count());
  return particles <= kMaxParticlesGivenAtOnce;
}

// The earlier of two times, of which either may be missing.
std::optional<int64_t> Earlier(std::optional<int64_t> a, std::optional<int64_t> b) {
  if (!a || !b) return a ? a : b;
  return std::min(*a, *b);
}

Status QueueFull(const std::string& limit, uint32_t value, int64_t retry_after_ms) {
  Status status(StatusCode::kResourceExhausted, "QUEUE_FULL",
                "the queue is full: " + limit + " is " + std::to_string(value));
  status.RetryAfterMs(retry_after_ms);
  return status;
}

}  // namespace

Status DrainingStatus() {
  return {StatusCode::kUnavailable, "DRAINING", "the server is shutting down"};
}

Scheduler::Core::Core(const SchedulerLimits& limits, const Clock& clock)
    : limits_(limits),
      clock_(clock),
      rates_(clock),
      observer_permits_("TOO_MANY_SUBSCRIPTIONS",
                        {"max_observers_per_session", limits.max_observers_per_session},
                        PermitLimit{"max_observers", limits.max_observers}, std::nullopt),
      read_permits_("TOO_MANY_READS",
                    {"max_reads_in_flight_per_session", limits.max_reads_in_flight_per_session},
                    PermitLimit{"max_reads_in_flight", limits.max_reads_in_flight},
                    limits.retry_after_ms),
      observers_(
          [this](std::function<void()> function) { completions_.Push(std::move(function)); }),
      gathering_(limits.max_queue_delay_us) {}

Status Scheduler::Core::Start(BackendFactory factory) {
  std::promise<Status> started;
  std::future<Status> outcome = started.get_future();
  device_thread_ = std::thread([this, &factory, &started] { DeviceThread(factory, started); });
  const Status status = outcome.get();
  if (!status.ok()) device_thread_.join();
  return status;
}

Status Scheduler::Core::Post(const std::string& owner, DeviceCommand command) {
  const std::lock_guard lock(mutex_);
  if (is_draining_) return DrainingStatus();
  // As the places of requests (Submit).
  const size_t free =
      limits_.max_queued_commands - std::min<size_t>(limits_.max_queued_commands, commands_.size());
  if (commands_.size_of(owner) >= free) {
    return QueueFull("what max_queued_commands leaves free, and the caller has already,",
                     static_cast<uint32_t>(free), limits_.retry_after_ms);
  }
  See(owner, clock_.NowUs());
  commands_.Push(owner, std::move(command));
  Notify();
  return Status::Ok();
}

bool Scheduler::Core::PostCleanup(const std::string& owner, DeviceCommand command) {
  const std::lock_guard lock(mutex_);
  if (is_stopped_) return false;
  commands_.Push(owner, std::move(command));
  Notify();
  return true;
}

bool Scheduler::Core::PostFirst(const std::string& owner, DeviceCommand command) {
  const std::lock_guard lock(mutex_);
  if (is_stopped_) return false;
  commands_.PushFirst(owner, std::move(command));
  Notify();
  return true;
}

void Scheduler::Core::Continue(const std::string& owner, DeviceCommand command) {
  const std::lock_guard lock(mutex_);
  DRAPE_CHECK(!is_stopped_ && std::this_thread::get_id() == device_thread_id_,
              "the device thread takes commands as long as it runs one");
  commands_.PushNext(owner, std::move(command));
}

void Scheduler::Core::See(const std::string& owner, int64_t now_us) {
  if (owner != last_asked_.owner) asked_before_ = std::exchange(last_asked_, {owner});
  last_asked_.at_us = now_us;
}

bool Scheduler::Core::HasSeenOthers(const std::string& owner, int64_t now_us) const {
  const Asked& other = owner == last_asked_.owner ? asked_before_ : last_asked_;
  return other.at_us > now_us - kJustNow_us;
}

std::optional<CommandQueue::Entry> Scheduler::Core::NextCommand() {
  const std::lock_guard lock(mutex_);
  if (is_draining_) commands_.EndRests();
  return commands_.Pop(clock_.NowUs());
}

// Whoever takes the device for longer than a batch leaves it to others for a while.
void Scheduler::Core::EndCommand(const std::string& owner, int64_t took_us) {
  if (took_us <= limits_.batch_budget_us || owner.empty()) return;
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  if (HasSeenOthers(owner, now_us)) commands_.Rest(owner, now_us, now_us + kRests * took_us);
}

void Scheduler::Core::RunCommands(Backend& backend) {
  {
    const std::lock_guard lock(mutex_);
    commands_.BeginRound();
  }
  const int64_t begin_us = clock_.NowUs();
  for (int64_t now_us = begin_us; now_us - begin_us <= limits_.batch_budget_us;) {
    std::optional<CommandQueue::Entry> next = NextCommand();
    if (!next) return;
    const trace::Span span("command");
    next->command(backend);
    next->command = nullptr;
    const int64_t end_us = clock_.NowUs();
    EndCommand(next->owner, end_us - now_us);
    now_us = end_us;
  }
}

Status Scheduler::Core::Submit(StepWork work) {
  const std::lock_guard lock(mutex_);
  if (is_draining_) return DrainingStatus();
  if (request_count_ >= limits_.max_queued_requests) {
    return QueueFull("max_queued_requests", limits_.max_queued_requests, limits_.retry_after_ms);
  }
  const auto session = requests_.by_session.try_emplace(work.session, 0).first;
  if (session->second >= limits_.max_queued_requests_per_session) {
    return QueueFull("max_queued_requests_per_session", limits_.max_queued_requests_per_session,
                     limits_.retry_after_ms);
  }
  // A tenant may hold as many places as it leaves free: one alone half of them, each of N its share
  // of N + 1, so that whoever comes next finds room, however long the others' requests have to wait
  // (dynamic thresholds: Choudhury and Hahne, IEEE/ACM Transactions on Networking 6(2), 1998).
  const uint32_t free = limits_.max_queued_requests - request_count_;
  const auto owner = requests_.by_owner.try_emplace(work.owner(), 0).first;
  if (!work.tenant.empty() && owner->second >= free) {
    if (session->second == 0) requests_.by_session.erase(session);
    return QueueFull("what max_queued_requests leaves free, and the tenant has already,", free,
                     limits_.retry_after_ms);
  }
  ++owner->second;
  ++session->second;
  ++request_count_;
  const int64_t now_us = clock_.NowUs();
  See(work.owner(), now_us);
  gathering_.Arrive(work.session, now_us);
  submissions_.push_back({std::move(work), now_us});
  // While more requests are awaited, the device thread need not wake for each one.
  if (gathering_.awaited_count() == 0) Notify();
  return Status::Ok();
}

void Scheduler::Core::EndRequest(StepWork work, StepOutcome outcome) {
  bool is_idle = false;
  {
    const std::lock_guard lock(mutex_);
    --request_count_;
    const auto session = requests_.by_session.find(work.session);
    gathering_.Answer(work.session, --session->second, clock_.NowUs());
    if (session->second == 0) requests_.by_session.erase(session);
    const auto owner = requests_.by_owner.find(work.owner());
    if (--owner->second == 0) requests_.by_owner.erase(owner);
    is_idle = request_count_ == 0 && commands_.empty() && observers_.size() == 0;
  }
  Give(std::move(work), std::move(outcome), is_idle);
}

void Scheduler::Core::Give(StepWork work, StepOutcome outcome, bool is_idle) {
  const bool is_short = IsShort(work, outcome);
  // std::function needs copyable captures; the outcome is moved out once.
  auto held = std::make_shared<StepOutcome>(std::move(outcome));
  auto give = [work = std::move(work), held] { work.done(std::move(*held)); };
  if (is_idle && is_short) {
    completions_.RunOrPush(std::move(give));
  } else {
    completions_.Push(std::move(give));
  }
}

void Scheduler::Core::DeviceThread(const BackendFactory& factory, std::promise<Status>& started) {
  device_thread_id_ = std::this_thread::get_id();
  trace::NameThread("device");
  Result<std::unique_ptr<Backend>> made = factory();
  if (!made.ok()) {
    started.set_value(made.status());
    return;
  }
  const std::unique_ptr<Backend> backend = std::move(made).value();
  description_ = backend->Describe();
  spdlog::info("device_thread_started backend={} device=\"{}\"", description_.name,
               description_.device);
  started.set_value(Status::Ok());  // neither reference is valid from here on
  RunRounds(*backend);
  spdlog::info("device_thread_stopped rounds={}", round_counters_.rounds.load());
}

void Scheduler::Core::RunRounds(Backend& backend) {
  DeviceLoop::Settings settings;
  settings.batch.max_cost = limits_.max_cloths_per_batch;
  settings.batch_budget_us = limits_.batch_budget_us;
  settings.max_long_step_bytes = limits_.max_long_step_bytes;
  settings.max_steps_per_request = limits_.max_steps_per_request;
  DeviceLoop loop(
      backend, settings, clock_,
      [this](StepWork work, StepOutcome outcome) {
        EndRequest(std::move(work), std::move(outcome));
      },
      round_counters_, rates_);
  Load load;
  for (;;) {
    Inbox inbox = TakeInbox(load);
    RunCommands(backend);
    for (Submission& submission : inbox.submissions) {
      loop.Admit(std::move(submission.work), submission.submitted_us);
    }
    if (inbox.is_last) break;
    if (const std::optional<int64_t> batch_us = loop.RunRound(); batch_us.has_value()) {
      const std::lock_guard lock(mutex_);
      gathering_.EndBatch(*batch_us);
    }
    const std::optional<int64_t> rest_until_us = loop.RestUntil_us();
    load.has_requests = loop.has_requests();
    load.is_busy = load.has_requests && !rest_until_us;
    if (!MayAnswersWait(loop, load.is_busy)) loop.GiveAnswers();
    load.wake_at_us = Earlier(observers_.Serve(backend, clock_.NowUs()), rest_until_us);
  }
  loop.EndAll({StatusCode::kUnavailable, "DRAINING",
               "the server is shutting down before the request is complete; complete steps stay, "
               "also in the session's checkpoint where the server writes one: read `step` then"});
  observers_.EndAll(DrainingStatus());
  if (last_command_) last_command_(backend);
}

bool Scheduler::Core::IsBatchDue(bool is_busy) const {
  if (submissions_.empty()) return false;
  return is_busy || is_draining_ || gathering_.awaited_count() == 0;
}

bool Scheduler::Core::MayAnswersWait(const DeviceLoop& loop, bool is_busy) const {
  if (observers_.size() > 0) return false;
  const std::lock_guard lock(mutex_);
  if (is_held_ || !commands_.empty()) return false;
  if (is_busy) return true;
  if (!IsBatchDue(false)) return false;
  std::map<std::string, uint32_t> unanswered;
  for (const std::string& session : loop.UnansweredSessions()) ++unanswered[session];
  return std::all_of(unanswered.begin(), unanswered.end(), [&](const auto& entry) {
    return requests_.by_session.at(entry.first) > entry.second;
  });
}

bool Scheduler::Core::IsAtTheEnd(bool has_requests) const {
  if (!is_draining_ || !commands_.empty()) return false;
  const bool is_idle = !has_requests && submissions_.empty();
  return is_idle || hurry_.is_cancelled() || clock_.NowUs() >= drain_deadline_us_;
}

void Scheduler::Core::Notify() {
  news_.fetch_add(1, std::memory_order_release);
  wake_.notify_all();
}

void Scheduler::Core::SpinForNews(std::unique_lock<std::mutex>& lock, int64_t until_us) {
  const uint64_t seen = news_.load(std::memory_order_relaxed);
  lock.unlock();
  while (news_.load(std::memory_order_acquire) == seen && clock_.NowUs() < until_us) {
    std::this_thread::yield();  // the notifying thread may need this core
  }
  lock.lock();
}

bool Scheduler::Core::HasWork(const Load& load) const {
  const std::optional<int64_t> ready_us = commands_.ReadyAt_us();
  const bool has_commands = ready_us && (is_draining_ || *ready_us <= clock_.NowUs());
  return load.is_busy || is_woken_ || has_commands || IsBatchDue(load.is_busy) ||
         IsAtTheEnd(load.has_requests);
}

void Scheduler::Core::Sleep(std::unique_lock<std::mutex>& lock, const Deadline& until) {
  if (until.has_value()) {
    wake_.wait_until(lock, *until);
  } else {
    wake_.wait(lock);
  }
}

void Scheduler::Core::WaitForWork(std::unique_lock<std::mutex>& lock, const Load& load) {
  using std::chrono::microseconds;
  using std::chrono::steady_clock;
  Deadline wake_at;
  for (;;) {
    const std::optional<int64_t> wake_at_us = Earlier(load.wake_at_us, commands_.ReadyAt_us());
    if (wake_at_us.has_value() && !wake_at.has_value()) {
      const int64_t wait_us = std::max(*wake_at_us - clock_.NowUs(), kMinWait_us);
      wake_at = steady_clock::now() + microseconds(wait_us);
    }
    const int64_t now_us = clock_.NowUs();
    const std::optional<int64_t> gather_until_us = gathering_.WaitUntil(now_us);
    if (is_held_) {
      Sleep(lock, std::nullopt);
      continue;
    }
    if (HasWork(load)) return;
    if (wake_at.has_value() && steady_clock::now() >= *wake_at) return;
    const int64_t spin_until_us = gathering_.SpinUntil();
    if (now_us < spin_until_us) {
      SpinForNews(lock, std::min(spin_until_us, wake_at_us.value_or(spin_until_us)));
      continue;
    }
    Deadline until = wake_at;
    if (gather_until_us.has_value()) {
      const auto gather_until = steady_clock::now() + microseconds(*gather_until_us - now_us);
      until = std::min(gather_until, wake_at.value_or(gather_until));
    }
    Sleep(lock, until);
  }
}

Scheduler::Core::Inbox Scheduler::Core::TakeInbox(const Load& load) {
  std::unique_lock lock(mutex_);
  is_parked_ = true;
  parked_.notify_all();
  WaitForWork(lock, load);
  is_parked_ = false;
  is_woken_ = false;
  Inbox inbox;
  inbox.is_last = IsAtTheEnd(load.has_requests);
  is_stopped_ = inbox.is_last;
  if (IsBatchDue(load.is_busy) || inbox.is_last) inbox.submissions.swap(submissions_);
  return inbox;
}

void Scheduler::Core::Drain(int64_t grace_us, DeviceCommand last, const CancelToken& hurry) {
  DRAPE_CHECK(!IsOnOwnThread(), "a thread cannot wait for itself");
  const std::lock_guard drain_lock(drain_mutex_);
  if (!device_thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    is_draining_ = true;
    is_held_ = false;
    drain_deadline_us_ = clock_.NowUs() + grace_us;
    last_command_ = std::move(last);
    hurry_ = hurry;
    Notify();
  }
  device_thread_.join();
  completions_.Stop();
}

void Scheduler::Core::Hold() {
  std::unique_lock lock(mutex_);
  is_held_ = true;
  parked_.wait(lock, [this] { return is_parked_ || is_stopped_; });
}

void Scheduler::Core::Release() {
  const std::lock_guard lock(mutex_);
  is_held_ = false;
  is_woken_ = true;  // a rate limit may have passed meanwhile
  Notify();
}

void Scheduler::Core::Wake() {
  const std::lock_guard lock(mutex_);
  is_woken_ = true;
  Notify();
}

bool Scheduler::Core::is_draining() const {
  const std::lock_guard lock(mutex_);
  return is_draining_;
}

QueuedRequests Scheduler::Core::queued_requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

SchedulerCounters Scheduler::Core::counters() const {
  SchedulerCounters counters;
  counters.rounds = round_counters_.rounds;
  counters.dispatches = round_counters_.dispatches;
  counters.cloth_steps = round_counters_.cloth_steps;
  counters.cloth_steps_asleep = round_counters_.cloth_steps_asleep;
  counters.faults = round_counters_.faults;
  counters.long_step_pieces = round_counters_.long_step_pieces;
  counters.batch_durations = round_counters_.batch_durations.Read();
  counters.request_durations = round_counters_.request_durations.Read();
  counters.frames_sent = observers_.counters().frames_sent;
  counters.frames_dropped = observers_.counters().frames_dropped;
  counters.slow_consumers = observers_.counters().slow_consumers;
  const std::lock_guard lock(mutex_);
  counters.queued_requests = request_count_;
  counters.queued_commands = static_cast<uint32_t>(commands_.size());
  return counters;
}

}  // namespace drape
