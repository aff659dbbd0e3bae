// Which requests are sent again when they got no answer, when, and how often.
#pragma once

#include <grpcpp/support/status.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>

#include "drape/client.h"
#include "drape/error.h"
#include "drape/v1/admin_service.pb.h"
#include "drape/v1/simulation_service.pb.h"

namespace drape {
inline namespace client {

// What a connection may spend on sending again: RetryOptions::budget. Without it a server that is
// away, or has too much to do, would get every request several times. Thread-safe.
class RetryBudget {
 public:
  explicit RetryBudget(double size) : size_(size), left_(size) {}

  // A request got its answer.
  void Refill();
  // A request failed. True: something may be sent again.
  bool Take();

 private:
  const double size_;
  std::mutex mutex_;
  double left_;  // guarded by mutex_
};

// Request ids that no other connection makes. Thread-safe.
class RequestIds {
 public:
  RequestIds();
  std::string Next();

 private:
  const std::string prefix_;
  std::atomic<uint64_t> count_ = 0;
};

// What a request does that arrives twice.
enum class Twice {
  kReadsAgain,  // it changes nothing
  kIsKnown,     // nothing: the server knows it again
  kDoesAgain,   // so it is not sent again, unless nobody can have seen it
};

// The sendings of one request.
class Tries {
 public:
  // `options` and `budget` outlive it.
  Tries(const RetryOptions& options, RetryBudget& budget, Twice twice)
      : options_(options), budget_(budget), twice_(twice) {}

  // After a sending that ended like this: how long to wait before the next one. Unset: none.
  std::optional<std::chrono::nanoseconds> PauseAfter(const ErrorDetails& details);
  // Sendings so far that may have changed something, about which nobody knows whether they did.
  uint32_t unanswered() const { return unanswered_; }
  // The sending that ended like this may have changed something, and unanswered() does not say it.
  bool IsInDoubt(const ErrorDetails& details) const;

 private:
  const RetryOptions& options_;
  RetryBudget& budget_;
  const Twice twice_;
  uint32_t sent_ = 0;  // without those that found an earlier one under way
  uint32_t pauses_ = 0;
  uint32_t unanswered_ = 0;
};

template <class Request, class... Kinds>
inline constexpr bool kIsOneOf = (std::is_same_v<Request, Kinds> || ...);

// Requests that change nothing, or the same however often they are done.
template <class Request>
inline constexpr bool kIsIdempotent =
    kIsOneOf<Request, v1::GetServerInfoRequest, v1::GetSessionRequest, v1::ListSessionsRequest,
             v1::RenewSessionRequest, v1::GetClothRequest, v1::ListClothsRequest,
             v1::ReadStatesRequest, v1::ReadTopologyRequest, v1::RenderRequest,
             v1::ExportClothsRequest, v1::ListTenantsRequest, v1::ListAllSessionsRequest>;

// With a request_id, or with a guard of its step and nothing that would be applied once more.
bool IsRepeatableStep(const v1::StepRequest& request);

template <class Request>
Twice IfSentTwice(const Request& request) {
  if constexpr (kIsIdempotent<Request>) {
    return Twice::kReadsAgain;
  } else if constexpr (std::is_same_v<Request, v1::StepRequest>) {
    return IsRepeatableStep(request) ? Twice::kIsKnown : Twice::kDoesAgain;
  } else if constexpr (requires { request.request_id(); }) {
    return request.request_id().empty() ? Twice::kDoesAgain : Twice::kIsKnown;
  } else {
    return Twice::kDoesAgain;
  }
}

}  // namespace client
}  // namespace drape
