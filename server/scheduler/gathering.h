// How long a batch waits for sessions that are about to ask again.
#pragma once

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
  // The longest wait for a session after its answer; 0: batches never wait.
  explicit Gathering(int64_t max_delay_us) : max_delay_us_(max_delay_us) {}

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
  // If a single session is awaited and it came back within kSpin_us last time: until when to spin
  // for it instead of sleeping; otherwise 0. Waking a thread on an idle core takes 25 us or more,
  // which a loop of single steps would pay in every step.
  int64_t SpinUntil() const;

  // Longest time to spin after an answer [us].
  static constexpr int64_t kSpin_us = 500;

 private:
  struct Visitor {
    int64_t answered_us = 0;
    bool is_away = false;     // all its requests are answered
    bool comes_back = false;  // in time, last time
    bool is_quick = false;    // within kSpin_us, last time
  };

  const int64_t max_delay_us_;
  double batch_us_ = 0;  // duration of the longest recent batch
  int64_t delay_us_ = 0;
  std::unordered_map<std::string, Visitor> sessions_;
  uint32_t awaited_count_ = 0;
};

}  // namespace drape
