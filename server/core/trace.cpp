#include "server/core/trace.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace drape::trace {
namespace {

struct Event {
  const char* name;
  int64_t begin_us;
  int64_t end_us;
  bool is_wait;
  std::array<Number, 2> numbers;
};

// What one thread has recorded. Its own mutex, which only Stop ever contends.
struct Buffer {
  std::mutex mutex;
  const char* thread_name = "thread";
  uint32_t recording = 0;  // to which the events belong
  std::vector<Event> events;
};

std::mutex buffers_mutex;
std::vector<std::shared_ptr<Buffer>>& Buffers() {
  static auto& buffers = *new std::vector<std::shared_ptr<Buffer>>();  // threads may outlive main
  return buffers;
}
std::atomic<uint32_t> last_recording{0};
std::atomic<uint64_t> asked{0};  // events of the recording under way, those left out included
int64_t begin_us = 0;            // of it; guarded by buffers_mutex

thread_local const char* thread_name = "thread";
thread_local std::shared_ptr<Buffer> own;

int64_t Clock_us() {
  using std::chrono::steady_clock;
  return std::chrono::duration_cast<std::chrono::microseconds>(
             steady_clock::now().time_since_epoch())
      .count();
}

Buffer& Own() {
  if (own == nullptr) {
    own = std::make_shared<Buffer>();
    const std::lock_guard lock(buffers_mutex);
    Buffers().push_back(own);
  }
  return *own;
}

void Record(uint32_t recording, const Event& event) {
  if (asked.fetch_add(1, std::memory_order_relaxed) >= kMaxEvents) return;
  Buffer& buffer = Own();
  const std::lock_guard lock(buffer.mutex);
  if (recording != internal::recording.load(std::memory_order_relaxed)) return;
  if (buffer.recording != recording) buffer.events.clear();
  buffer.recording = recording;
  buffer.thread_name = thread_name;
  buffer.events.push_back(event);
}

void AppendNumbers(const Event& event, fmt::memory_buffer& json) {
  const char* separator = ",\"args\":{";
  for (const Number& number : event.numbers) {
    if (number.name == nullptr) continue;
    fmt::format_to(std::back_inserter(json), "{}\"{}\":{}", separator, number.name, number.value);
    separator = ",";
  }
  if (*separator == ',' && separator[1] == '\0') json.push_back('}');
}

// Waits overlap each other and what the thread does, so they have rows of their own.
void AppendEvent(const Event& event, size_t thread, uint64_t id, int64_t origin_us,
                 fmt::memory_buffer& json) {
  const auto out = std::back_inserter(json);
  const int64_t begin = std::max<int64_t>(0, event.begin_us - origin_us);
  const int64_t end = event.end_us - origin_us;
  if (event.is_wait) {
    for (const auto& [phase, at_us] : {std::pair('b', begin), std::pair('e', end)}) {
      fmt::format_to(out,
                     ",\n{{\"name\":\"{}\",\"cat\":\"wait\",\"ph\":\"{}\",\"id\":{},\"ts\":{},"
                     "\"pid\":1,\"tid\":{}}}",
                     event.name, phase, id, at_us, thread);
    }
    return;
  }
  fmt::format_to(out, ",\n{{\"name\":\"{}\",\"ph\":\"X\",\"ts\":{},\"dur\":{},\"pid\":1,\"tid\":{}",
                 event.name, begin, end - begin, thread);
  AppendNumbers(event, json);
  json.push_back('}');
}

}  // namespace

void NameThread(const char* name) {
  thread_name = name;
}

void Span::Begin(const char* name) {
  name_ = name;
  recording_ = internal::recording.load(std::memory_order_relaxed);
  begin_us_ = Clock_us();
}

void Span::End() const {
  if (recording_ != internal::recording.load(std::memory_order_relaxed)) return;
  Record(recording_, {name_, begin_us_, Clock_us(), false, numbers_});
}

int64_t Now_us() {
  return IsOn() ? Clock_us() : 0;
}

void Waited(const char* name, int64_t since_us) {
  const uint32_t recording = internal::recording.load(std::memory_order_relaxed);
  if (recording == 0 || since_us == 0) return;
  Record(recording, {name, since_us, Clock_us(), true, {}});
}

Status Start() {
  const std::lock_guard lock(buffers_mutex);
  if (IsOn()) {
    return Status(StatusCode::kAborted, "TRACE_IN_PROGRESS",
                  "another recording is under way: wait until it ends");
  }
  // Of threads that have ended.
  std::erase_if(Buffers(), [](const auto& buffer) { return buffer.use_count() == 1; });
  asked = 0;
  begin_us = Clock_us();
  internal::recording = ++last_recording;
  return Status::Ok();
}

Recording Stop() {
  const std::lock_guard lock(buffers_mutex);
  const uint32_t recording = internal::recording.exchange(0);
  Recording result;
  fmt::memory_buffer json;
  fmt::format_to(
      std::back_inserter(json),
      "{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n"
      "{{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{{\"name\":\"draped\"}}}}");
  for (size_t thread = 0; thread < Buffers().size(); ++thread) {
    Buffer& buffer = *Buffers()[thread];
    const std::lock_guard buffer_lock(buffer.mutex);
    if (buffer.recording == recording && !buffer.events.empty()) {
      fmt::format_to(std::back_inserter(json),
                     ",\n{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{},"
                     "\"args\":{{\"name\":\"{}\"}}}}",
                     thread, buffer.thread_name);
      for (const Event& event : buffer.events) {
        AppendEvent(event, thread, result.events++, begin_us, json);
      }
    }
    buffer.events = {};
  }
  const uint64_t wanted = asked;
  result.left_out = wanted - std::min<uint64_t>(wanted, kMaxEvents);
  fmt::format_to(std::back_inserter(json), "\n],\"otherData\":{{\"events_left_out\":{}}}}}\n",
                 result.left_out);
  result.json.assign(json.data(), json.size());
  return result;
}

}  // namespace drape::trace
