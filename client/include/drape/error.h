// The exceptions of the client library.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace drape {
// Inline, so that users write drape::Client, while its symbols differ from the server's in a test
// that links both.
inline namespace client {

// The canonical codes of google.rpc.Code, with their numbers.
enum class ErrorCode {
  kCancelled = 1,
  kUnknown = 2,
  kInvalidArgument = 3,
  kDeadlineExceeded = 4,
  kNotFound = 5,
  kAlreadyExists = 6,
  kPermissionDenied = 7,
  kResourceExhausted = 8,
  kFailedPrecondition = 9,
  kAborted = 10,
  kOutOfRange = 11,
  kUnimplemented = 12,
  kInternal = 13,
  kUnavailable = 14,
  kDataLoss = 15,
  kUnauthenticated = 16,
};

// "INVALID_ARGUMENT", ...
std::string_view ErrorCodeName(ErrorCode code);

// One bad field of a request or of a scene file.
struct FieldViolation {
  std::string field;        // path, e.g. "spec.pins[2].particle"
  std::string description;  // the value and the legal range
};

// Everything that is known about a failure.
struct ErrorDetails {
  ErrorCode code = ErrorCode::kUnknown;
  std::string message;
  // A constant word for programs, e.g. "SESSION_EXPIRED". Failures on this side of the wire have
  // the domain "drape.client", answers of a server "drape".
  std::string reason;
  std::string domain;
  std::map<std::string, std::string> metadata;
  std::vector<FieldViolation> violations;
  // The exhausted quota, for kResourceExhausted.
  std::vector<std::string> quotas;
  // Time to wait before a repetition; unset if waiting does not help.
  std::optional<std::chrono::milliseconds> retry_after;
  // Sendings of the same change before the last one that had no answer: they may have been done.
  // See RetryOptions.
  uint32_t unanswered_tries = 0;
};

// Thrown by every call of the library that fails: refusals of the server, failed transport, and bad
// local files. what() is one line for people: code, reason, message and every bad field.
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorDetails details);

  ErrorCode code() const noexcept { return details_->code; }
  const std::string& reason() const noexcept { return details_->reason; }
  const std::vector<FieldViolation>& violations() const noexcept { return details_->violations; }
  const ErrorDetails& details() const noexcept { return *details_; }

 private:
  std::shared_ptr<const ErrorDetails> details_;  // copying an exception must not throw
};

// The session does not exist, or its lease is over: everything in it is lost. Of a session that had
// been stepped, the metadata has `told_step`, the highest step of the last answer to a Step.
class SessionLost : public Error {
 public:
  using Error::Error;
};

// The server has started again and holds the session as it was when its last checkpoint was
// written; nothing is done before Session::Reattach. The message says when that was and at which
// steps the cloths are now, and the metadata has `told_step` as above.
class StateLost : public Error {
 public:
  using Error::Error;
};

}  // namespace client
}  // namespace drape
