// Recordings of what the threads of the server do, as Chrome's trace events.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "server/core/status.h"

namespace drape::trace {

namespace internal {
// Number of the recording under way, 0: none. Each has another one.
inline std::atomic<uint32_t> recording{0};
}  // namespace internal

// Whether somebody records. All that nobody pays for otherwise is this question.
inline bool IsOn() {
  return internal::recording.load(std::memory_order_relaxed) != 0;
}

// A number that belongs to an event. Names are literals, here and below, of letters and '_'.
struct Number {
  const char* name = nullptr;
  int64_t value = 0;
};

// What the calling thread is called in recordings from now on.
void NameThread(const char* name);

// Something that the calling thread does as long as this lives. What was under way when the
// recording began or ended is not in it.
class Span {
 public:
  explicit Span(const char* name) {
    if (IsOn()) Begin(name);
  }
  ~Span() {
    if (name_ != nullptr) End();
  }
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;

  // Two at most.
  void Add(const char* name, int64_t value) {
    if (name_ != nullptr && count_ < numbers_.size()) numbers_[count_++] = {name, value};
  }

 private:
  void Begin(const char* name);
  void End() const;

  const char* name_ = nullptr;  // null: not recorded
  uint32_t recording_ = 0;
  int64_t begin_us_ = 0;
  std::array<Number, 2> numbers_;
  size_t count_ = 0;
};

// Somebody waited from `begin_us` until now, by SteadyClock, while this thread did other things;
// 0: nothing is recorded.
void Waited(const char* name, int64_t begin_us);
// The time for Waited; 0 while nobody records.
int64_t Now_us();

// Limit of all events of a recording: 20 MB. More are counted and left out.
inline constexpr uint32_t kMaxEvents = 1u << 18;

// ABORTED (TRACE_IN_PROGRESS) while another recording is under way. Any thread, as Stop.
Status Start();

struct Recording {
  std::string json;  // {"traceEvents": [...], ...}
  uint64_t events = 0;
  uint64_t left_out = 0;
};
// Ends the recording that Start began.
Recording Stop();

}  // namespace drape::trace
