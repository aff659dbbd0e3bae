// Makes requests with an id happen exactly once.
#pragma once

#include <any>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/core/status.h"

namespace drape {

// The completed answers of one session, the newest ones only (SessionLimits). Thread-safe. Use:
//   Result<std::any> known = memory.Begin(id, fingerprint);
//   if (!known.ok()) -> answer with the error
//   if (known->has_value()) -> answer with std::any_cast<Answer>(*known)
//   ... do the work ...
//   success: memory.Complete(id, answer, bytes)     failure: memory.Abandon(id)
class RequestMemory {
 public:
  RequestMemory(uint32_t max_answers, size_t max_bytes)
      : max_answers_(max_answers), max_bytes_(max_bytes) {}

  // An empty any: the id is new and under way from now on. Otherwise the remembered answer. Errors:
  //   ABORTED REQUEST_IN_PROGRESS: the first request with this id is not complete (retry later).
  //   INVALID_ARGUMENT naming "request_id": the id was used for a different request (the
  //   fingerprint, a hash of method and content, differs), or is longer than kMaxRequestIdBytes.
  // An empty id is always new; Complete and Abandon of it do nothing.
  Result<std::any> Begin(const std::string& request_id, uint64_t fingerprint);
  // `answer_bytes`: the approximate size of the answer.
  void Complete(const std::string& request_id, std::any answer, size_t answer_bytes);
  // The request failed: the id may be used again.
  void Abandon(const std::string& request_id);

 private:
  struct Entry {
    uint64_t fingerprint = 0;
    std::any answer;  // empty while under way
    size_t answer_bytes = 0;
  };

  const uint32_t max_answers_;
  const size_t max_bytes_;
  std::mutex mutex_;
  std::unordered_map<std::string, Entry> entries_;
  std::deque<std::string> completed_;  // oldest first
  size_t bytes_ = 0;
};

// Longest request id [bytes].
inline constexpr size_t kMaxRequestIdBytes = 128;

}  // namespace drape
