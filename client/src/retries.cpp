#include "client/src/retries.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

namespace drape {
inline namespace client {
namespace {

// As gRPC throttles its own retries (A6): an answer makes up for a tenth of a failure, and nothing
// is sent again from the half of the budget down.
constexpr double kRefill = 0.1;
// Pauses are longer or shorter by up to this part, so that clients of one server that was away do
// not all come back at the same moment.
constexpr double kJitter = 0.2;
constexpr char kInProgress[] = "REQUEST_IN_PROGRESS";

std::string RandomPrefix() {
  std::random_device random;
  char text[40];
  (void)std::snprintf(text, sizeof(text), "%08x%08x%08x-", random(), random(), random());
  return text;
}

// From 0 to kJitter.
double RandomJitter() {
  thread_local std::minstd_rand random{std::random_device{}()};
  return std::uniform_real_distribution<double>(0, kJitter)(random);
}

// There was no connection: no server has seen the request. So the messages of gRPC begin, 1.51 and
// newer.
bool IsUnsent(const ErrorDetails& details) {
  if (!details.reason.empty()) return false;
  for (const char* start :
       {"failed to connect to all addresses", "connections to all backends failing",
        "DNS resolution failed", "errors resolving "}) {
    if (details.message.starts_with(start)) return true;
  }
  return false;
}

std::chrono::nanoseconds Seconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(seconds));
}

}  // namespace

void RetryBudget::Refill() {
  const std::lock_guard lock(mutex_);
  left_ = std::min(size_, left_ + kRefill);
}

bool RetryBudget::Take() {
  const std::lock_guard lock(mutex_);
  left_ = std::max(0.0, left_ - 1);
  return left_ > size_ / 2;
}

RequestIds::RequestIds() : prefix_(RandomPrefix()) {}

std::string RequestIds::Next() {
  return prefix_ + std::to_string(count_++);
}

std::optional<std::chrono::nanoseconds> Tries::PauseAfter(const ErrorDetails& details) {
  const bool is_asked_to_wait = details.retry_after.has_value();
  const double jitter = RandomJitter();
  const auto asked = [&] {
    return Seconds(std::chrono::duration<double>(*details.retry_after).count() * (1 + jitter));
  };
  // The server is at it: the answer takes as long as it would have taken the first sending.
  if (is_asked_to_wait && details.reason == kInProgress && options_.max_tries > 1) return asked();
  const bool has_no_answer = details.code == ErrorCode::kUnavailable && !is_asked_to_wait;
  if (!is_asked_to_wait && !has_no_answer) return std::nullopt;
  const bool is_within_budget = budget_.Take();
  if (++sent_ >= options_.max_tries || !is_within_budget) return std::nullopt;
  // Who asks to wait has done nothing, so that any request may be sent again.
  if (is_asked_to_wait) return asked();
  if (!IsUnsent(details)) {
    if (twice_ == Twice::kDoesAgain) return std::nullopt;
    if (twice_ == Twice::kIsKnown) ++unanswered_;
  }
  const double pause_s =
      std::min(options_.first_pause_s * std::pow(2.0, pauses_++), options_.max_pause_s);
  return Seconds(pause_s * (1 - kJitter + 2 * jitter));
}

bool Tries::IsInDoubt(const ErrorDetails& details) const {
  return twice_ != Twice::kReadsAgain && unanswered_ == 0 &&
         details.code == ErrorCode::kUnavailable && details.reason.empty() && !IsUnsent(details);
}

bool IsRepeatableStep(const v1::StepRequest& request) {
  if (!request.request_id().empty()) return true;
  const bool is_guarded =
      request.has_expected_step() || request.extent_case() == v1::StepRequest::kUntilStep;
  const bool applies_something = request.has_pin_controls() || request.has_rest_length_controls() ||
                                 request.has_rest_length_scales() ||
                                 request.has_collider_controls() || request.has_grip_controls() ||
                                 request.has_resets() || request.has_loads();
  return is_guarded && !applies_something;
}

}  // namespace client
}  // namespace drape
