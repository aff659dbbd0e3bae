#include "server/session/request_memory.h"

#include <utility>

#include "server/core/check.h"

namespace drape {
namespace {

// Suggested delay for a client whose request is still under way [ms].
constexpr int64_t kRetryAfter_ms = 50;

}  // namespace

Result<std::any> RequestMemory::Begin(const std::string& request_id, uint64_t fingerprint) {
  if (request_id.empty()) return std::any();
  if (request_id.size() > kMaxRequestIdBytes) {
    return Status::InvalidField("request_id",
                                "at most " + std::to_string(kMaxRequestIdBytes) + " bytes");
  }
  const std::lock_guard lock(mutex_);
  const auto [entry, is_new] = entries_.try_emplace(request_id);
  if (is_new) {
    entry->second.fingerprint = fingerprint;
    return std::any();
  }
  if (entry->second.fingerprint != fingerprint) {
    return Status::InvalidField("request_id", "was used for a different request");
  }
  if (!entry->second.answer.has_value()) {
    Status status(StatusCode::kAborted, "REQUEST_IN_PROGRESS",
                  "a request with this request_id is still under way");
    return status.RetryAfterMs(kRetryAfter_ms);
  }
  return entry->second.answer;
}

void RequestMemory::Complete(const std::string& request_id, std::any answer, size_t answer_bytes) {
  if (request_id.empty()) return;
  DRAPE_CHECK(answer.has_value(), "an answer has a value");
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[request_id];
  entry.answer = std::move(answer);
  entry.answer_bytes = answer_bytes;
  completed_.push_back(request_id);
  bytes_ += answer_bytes;
  while (completed_.size() > max_answers_ || (bytes_ > max_bytes_ && completed_.size() > 1)) {
    const auto oldest = entries_.find(completed_.front());
    bytes_ -= oldest->second.answer_bytes;
    entries_.erase(oldest);
    completed_.pop_front();
  }
}

void RequestMemory::Abandon(const std::string& request_id) {
  if (request_id.empty()) return;
  const std::lock_guard lock(mutex_);
  entries_.erase(request_id);
}

}  // namespace drape
