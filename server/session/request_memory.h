// Makes requests with an id happen exactly once.
#pragma once

#include <any>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/core/byte_budget.h"
#include "server/core/clock.h"
#include "server/core/status.h"

namespace drape {

struct RequestMemoryLimits {
  // How long an id is known after its request is complete, and how many ids at most: more requests
  // in that time are refused, never forgotten early.
  int64_t keep_us = 600'000'000;
  uint32_t max_ids = 1u << 18;
  // Answers that are kept, the newest ones; their ids stay known.
  size_t max_answer_bytes = size_t{64} << 20;
};

// The completed requests of one session. Thread-safe. Use:
//   Result<std::any> known = memory.Begin(id, fingerprint);
//   if (!known.ok()) -> answer with the error
//   if (known->has_value()) -> answer with std::any_cast<Answer>(*known)
//   ... do the work ...
//   success: memory.Complete(id, answer, bytes)     failure: memory.Abandon(id)
class RequestMemory {
 public:
  // `clock` outlives it. `answers` and `ids`, if any: for those of all sessions, taken in the name
  // of `owner`; answers without room are forgotten, ids refused with the error of the budget.
  RequestMemory(const RequestMemoryLimits& limits, const Clock& clock,
                std::shared_ptr<ByteBudget> answers = nullptr,
                std::shared_ptr<ByteBudget> ids = nullptr, std::string owner = {})
      : limits_(limits),
        clock_(clock),
        answer_budget_(std::move(answers)),
        id_budget_(std::move(ids)),
        owner_(std::move(owner)) {}

  // An empty any: the id is new and under way from now on. Otherwise the remembered answer. Errors:
  //   ABORTED REQUEST_IN_PROGRESS: the first request with this id is not complete (retry later).
  //   FAILED_PRECONDITION ANSWER_FORGOTTEN: the request was done; its answer is no longer kept.
  //   RESOURCE_EXHAUSTED TOO_MANY_REQUEST_IDS: max_ids are known, or those of all sessions leave no
  //   room for more of the owner (with retry_after).
  //   INVALID_ARGUMENT naming "request_id": the id was used for a different request (the
  //   fingerprint, a hash of method and content, differs), or is longer than kMaxRequestIdBytes.
  // An empty id is always new; Complete and Abandon of it do nothing.
  Result<std::any> Begin(const std::string& request_id, uint64_t fingerprint);
  // `answer_bytes`: the approximate size of the answer.
  void Complete(const std::string& request_id, std::any answer, size_t answer_bytes);
  // The same, of an answer that is not kept.
  void CompleteWithoutAnswer(const std::string& request_id);
  // Whether an answer of so many bytes is kept.
  bool Keeps(size_t answer_bytes) const { return answer_bytes <= limits_.max_answer_bytes; }
  // The request failed: the id may be used again.
  void Abandon(const std::string& request_id);
  // What need not be known any longer. Begin does this, too; for sessions that do not ask.
  void ForgetOld();

 private:
  struct Entry {
    uint64_t fingerprint = 0;
    bool is_complete = false;
    std::any answer;  // empty while under way, and once it is forgotten
    size_t answer_bytes = 0;
    std::shared_ptr<void> id_permit, answer_permit;  // of the budgets
  };
  struct Completion {
    std::string request_id;
    int64_t at_us = 0;
  };

  // With mutex_ held.
  void ForgetOldIds();
  // The oldest answer. False: there is none.
  bool ForgetAnswer();

  const RequestMemoryLimits limits_;
  const Clock& clock_;
  const std::shared_ptr<ByteBudget> answer_budget_, id_budget_;
  const std::string owner_;
  std::mutex mutex_;
  std::unordered_map<std::string, Entry> entries_;
  std::deque<Completion> completed_;      // oldest first
  std::deque<std::string> with_answers_;  // those of them whose answers are kept, oldest first
  size_t bytes_ = 0;
};

// Longest request id [bytes].
inline constexpr size_t kMaxRequestIdBytes = 128;

// Suggested delay for clients that have made too many requests with ids [ms].
inline constexpr int64_t kRetryWhenFull_ms = 1000;

}  // namespace drape
