#include "server/session/request_memory.h"

#include <utility>

#include "server/core/check.h"

namespace drape {
namespace {

// Suggested delay for clients whose request is still under way [ms].
constexpr int64_t kRetryAfter_ms = 50;
// What an id takes: in an entry, and three times the text itself [bytes].
constexpr size_t kIdOverhead = 320;
constexpr size_t kIdCopies = 3;
// What an answer takes besides its serialised size [bytes].
constexpr size_t kAnswerOverhead = 512;

}  // namespace

Result<std::any> RequestMemory::Begin(const std::string& request_id, uint64_t fingerprint) {
  if (request_id.empty()) return std::any();
  if (request_id.size() > kMaxRequestIdBytes) {
    return Status::InvalidField("request_id",
                                "at most " + std::to_string(kMaxRequestIdBytes) + " bytes");
  }
  const std::lock_guard lock(mutex_);
  ForgetOldIds();
  const auto known = entries_.find(request_id);
  if (known == entries_.end()) {
    if (entries_.size() >= limits_.max_ids) {
      Status status(StatusCode::kResourceExhausted, "TOO_MANY_REQUEST_IDS",
                    "max_request_ids_per_session is " + std::to_string(limits_.max_ids) +
                        ", and each is kept for " + std::to_string(limits_.keep_us / 1'000'000) +
                        " s");
      return status.RetryAfterMs(kRetryWhenFull_ms);
    }
    std::shared_ptr<void> permit;
    if (id_budget_ != nullptr) {
      DRAPE_ASSIGN_OR_RETURN(permit,
                             id_budget_->Take(owner_, kIdOverhead + kIdCopies * request_id.size()));
    }
    Entry& entry = entries_[request_id];
    entry.fingerprint = fingerprint;
    entry.id_permit = std::move(permit);
    return std::any();
  }
  const Entry& entry = known->second;
  if (entry.fingerprint != fingerprint) {
    return Status::InvalidField("request_id", "was used for a different request");
  }
  if (!entry.is_complete) {
    Status status(StatusCode::kAborted, "REQUEST_IN_PROGRESS",
                  "a request with this request_id is still under way");
    return status.RetryAfterMs(kRetryAfter_ms);
  }
  if (!entry.answer.has_value()) {
    return Status(StatusCode::kFailedPrecondition, "ANSWER_FORGOTTEN",
                  "the request with this request_id was done, but its answer is no longer kept");
  }
  return entry.answer;
}

void RequestMemory::Complete(const std::string& request_id, std::any answer, size_t answer_bytes) {
  if (request_id.empty()) return;
  DRAPE_CHECK(answer.has_value(), "an answer has a value");
  const size_t bytes = answer_bytes + kAnswerOverhead;
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[request_id];
  entry.is_complete = true;
  completed_.push_back({request_id, clock_.NowUs()});
  while (bytes_ + bytes > limits_.max_answer_bytes && ForgetAnswer()) {
  }
  while (answer_budget_ != nullptr) {
    Result<std::shared_ptr<void>> taken = answer_budget_->Take(owner_, bytes);
    if (taken.ok()) {
      entry.answer_permit = std::move(taken).value();
      break;
    }
    if (!ForgetAnswer()) return;  // this one too
  }
  entry.answer = std::move(answer);
  entry.answer_bytes = bytes;
  bytes_ += bytes;
  with_answers_.push_back(request_id);
}

void RequestMemory::CompleteWithoutAnswer(const std::string& request_id) {
  if (request_id.empty()) return;
  const std::lock_guard lock(mutex_);
  entries_[request_id].is_complete = true;
  completed_.push_back({request_id, clock_.NowUs()});
}

void RequestMemory::Abandon(const std::string& request_id) {
  if (request_id.empty()) return;
  const std::lock_guard lock(mutex_);
  entries_.erase(request_id);
}

void RequestMemory::ForgetOld() {
  const std::lock_guard lock(mutex_);
  ForgetOldIds();
}

void RequestMemory::ForgetOldIds() {
  const int64_t until_us = clock_.NowUs() - limits_.keep_us;
  while (!completed_.empty() && completed_.front().at_us <= until_us) {
    // Its answer is the oldest, too.
    if (!with_answers_.empty() && with_answers_.front() == completed_.front().request_id) {
      ForgetAnswer();
    }
    entries_.erase(completed_.front().request_id);
    completed_.pop_front();
  }
}

bool RequestMemory::ForgetAnswer() {
  if (with_answers_.empty()) return false;
  Entry& oldest = entries_.at(with_answers_.front());
  bytes_ -= oldest.answer_bytes;
  oldest.answer.reset();
  oldest.answer_permit = nullptr;
  with_answers_.pop_front();
  return true;
}

}  // namespace drape
