// Outcomes of operations that client input can make fail. Programmer errors use check.h instead.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/core/check.h"

namespace drape {

// The gRPC codes that Drape answers with; api/ maps them one to one.
enum class StatusCode {
  kOk,
  kInvalidArgument,
  kNotFound,
  kAlreadyExists,
  kFailedPrecondition,
  kAborted,
  kResourceExhausted,
  kUnavailable,
  kCancelled,
  kInternal,
};

std::string_view StatusCodeName(StatusCode code);

// One bad field of a request. `field` is the path as the client wrote it, e.g.
// "spec.pins[2].particle"; `description` names the value and the legal range.
struct FieldViolation {
  std::string field;
  std::string description;
};

// Success, or why not. Cheap to move; equality is not defined on purpose.
class [[nodiscard]] Status {
 public:
  Status() = default;
  // `reason` is a stable UPPER_CASE word for programs, `message` a sentence for people.
  Status(StatusCode code, std::string reason, std::string message)
      : code_(code), reason_(std::move(reason)), message_(std::move(message)) {}

  static Status Ok() { return {}; }
  // INVALID_ARGUMENT for one or several fields; the message lists them all.
  static Status InvalidFields(std::vector<FieldViolation> violations);
  static Status InvalidField(std::string field, std::string description);

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  const std::string& reason() const { return reason_; }
  const std::string& message() const { return message_; }
  const std::vector<FieldViolation>& violations() const { return violations_; }
  // Set only if waiting helps.
  const std::optional<int64_t>& retry_after_ms() const { return retry_after_ms_; }
  Status& RetryAfterMs(int64_t ms) {
    retry_after_ms_ = ms;
    return *this;
  }
  // "INVALID_ARGUMENT (INVALID_FIELDS): ..."
  std::string ToString() const;

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string reason_;
  std::string message_;
  std::vector<FieldViolation> violations_;
  std::optional<int64_t> retry_after_ms_;
};

// A value, or the status that explains its absence.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}        // NOLINT: implicit like std::expected
  Result(Status status) : content_(std::move(status)) {  // NOLINT
    DRAPE_CHECK(!std::get<Status>(content_).ok(), "a Result without a value needs an error");
  }

  bool ok() const { return std::holds_alternative<T>(content_); }
  Status status() const { return ok() ? Status::Ok() : std::get<Status>(content_); }
  T& value() & {
    DRAPE_CHECK(ok(), "value() of a failed Result");
    return std::get<T>(content_);
  }
  const T& value() const& {
    DRAPE_CHECK(ok(), "value() of a failed Result");
    return std::get<T>(content_);
  }
  T&& value() && {
    DRAPE_CHECK(ok(), "value() of a failed Result");
    return std::get<T>(std::move(content_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

 private:
  std::variant<T, Status> content_;
};

// Returns from the enclosing function if `expression` is a failed Status.
#define DRAPE_RETURN_IF_ERROR(expression)                                                        \
  do {                                                                                           \
    if (::drape::Status drape_status_ = (expression); !drape_status_.ok()) return drape_status_; \
  } while (false)

// Returns from the enclosing function if `expression` is a failed Result; else puts its value into
// `target`, which may be a declaration.
#define DRAPE_ASSIGN_OR_RETURN(target, expression) \
  DRAPE_ASSIGN_OR_RETURN_NAMED(DRAPE_CONCATENATE(drape_result_, __LINE__), target, expression)
#define DRAPE_ASSIGN_OR_RETURN_NAMED(result, target, expression) \
  auto result = (expression);                                    \
  if (!result.ok()) return result.status();                      \
  target = std::move(result).value()
#define DRAPE_CONCATENATE(a, b) DRAPE_CONCATENATE_EXPANDED(a, b)
#define DRAPE_CONCATENATE_EXPANDED(a, b) a##b

}  // namespace drape
