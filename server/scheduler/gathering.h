// How long a batch waits for sessions that are about to ask again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

namespace drape {

// Sessions that ask for one step after the other get their answers together and come back one by
// one. If the first one were stepped at once, alone, the others would form a second batch. So a
// batch waits for those that have shown that they come back soon. All times are from one clock
// [us]. Not thread-safe.
class Gathering {
 public:
  // The longest wait for a session after its answer; 0: batches never wait, and nobody spins.
  explicit Gathering(int64_t max_delay_us)
      : max_delay_us_(max_delay_us), spin_us_(std::min(kSpin_us, max_delay_us)) {}

  // A batch took this long. A session is awaited for at most twice the duration of the longest
  // recent batch.
  void EndBatch(int64_t batch_us);

  // The session submitted a request.
  void Arrive(const std::string& session, int64_t now_us);
  // A request of the session was answered; `left` of its requests are still under way.
  void Answer(const std::string& session, uint32_t left, int64_t now_us);

  // The number of sessions that came back quickly last time and are away now. The time that
  // WaitUntil returned may have passed.
  uint32_t awaited_count() const { return awaited_count_; }
  // When to begin the next batch without the awaited sessions; none: no session is awaited. A
  // session that has not come back in time is forgotten until it comes back quickly again.
  std::optional<int64_t> WaitUntil(int64_t now_us);
  // If a single session that came back within kSpin_us last time is away, and no other is awaited:
  // until when to spin for it instead of sleeping; otherwise 0. Waking a thread on an idle core
  // takes 25 us or more, which a loop of single steps would pay in every step, and where the
  // hypervisor has taken the core away meanwhile it finds cold caches.
  int64_t SpinUntil() const;

  // Longest time to spin after an answer [us].
  static constexpr int64_t kSpin_us = 500;

 private:
  struct Visitor {
    int64_t answered_us = 0;
    bool is_away = false;     // all its requests are answered
    bool comes_back = false;  // in time, last time; while it is away: it is awaited
    bool is_quick = false;    // within kSpin_us, last time; while it is away: it is looked for
  };
  // Counts it as away, or no longer.
  void Count(const Visitor& visitor, bool is_away);
  // Ends what its time is over for. Whether nothing is left.
  bool IsOver(Visitor& visitor, int64_t now_us);

  const int64_t max_delay_us_;
  const int64_t spin_us_;
  double batch_us_ = 0;  // duration of the longest recent batch
  int64_t delay_us_ = 0;
  std::unordered_map<std::string, Visitor> sessions_;
  // Of those away.
  uint32_t awaited_count_ = 0;
  uint32_t quick_count_ = 0;
  uint32_t quick_awaited_count_ = 0;
};

}  // namespace drape
