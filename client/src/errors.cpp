#include "client/src/errors.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>

#include <sstream>
#include <utility>

namespace drape {
inline namespace client {
namespace {

constexpr char kClientDomain[] = "drape.client";

void DecodeDetail(const google::protobuf::Any& any, ErrorDetails* details) {
  if (google::rpc::ErrorInfo info; any.UnpackTo(&info)) {
    details->reason = info.reason();
    details->domain = info.domain();
    details->metadata = {info.metadata().begin(), info.metadata().end()};
  } else if (google::rpc::BadRequest bad_request; any.UnpackTo(&bad_request)) {
    for (const auto& violation : bad_request.field_violations()) {
      details->violations.push_back({violation.field(), violation.description()});
    }
  } else if (google::rpc::QuotaFailure quota; any.UnpackTo(&quota)) {
    for (const auto& violation : quota.violations()) {
      details->quotas.push_back(violation.subject() + ": " + violation.description());
    }
  } else if (google::rpc::RetryInfo retry; any.UnpackTo(&retry)) {
    details->retry_after = std::chrono::milliseconds(retry.retry_delay().seconds() * 1000 +
                                                     retry.retry_delay().nanos() / 1'000'000);
  }
}

std::string OneLine(const ErrorDetails& details) {
  std::string text(ErrorCodeName(details.code));
  if (!details.reason.empty()) text += " (" + details.reason + ")";
  if (!details.message.empty()) text += ": " + details.message;
  for (const FieldViolation& violation : details.violations) {
    // A message that already is "field: description" needs no repetition.
    if (details.message.find(violation.field + ": " + violation.description) != std::string::npos) {
      continue;
    }
    text += "; " + violation.field + ": " + violation.description;
  }
  if (details.unanswered_tries > 0) {
    const uint32_t tries = details.unanswered_tries;
    text += "; sent " + (tries == 1 ? std::string("once") : std::to_string(tries) + " times") +
            " before without an answer: it may have been done";
  }
  return text;
}

bool IsSessionLost(const ErrorDetails& details) {
  return details.reason == "SESSION_NOT_FOUND" || details.reason == "SESSION_EXPIRED" ||
         details.reason == "SESSION_LOST";
}

bool IsStateLost(const ErrorDetails& details) {
  return details.reason == "STATE_LOST";
}

}  // namespace

std::string_view ErrorCodeName(ErrorCode code) {
  switch (code) {
    case ErrorCode::kCancelled:
      return "CANCELLED";
    case ErrorCode::kUnknown:
      return "UNKNOWN";
    case ErrorCode::kInvalidArgument:
      return "INVALID_ARGUMENT";
    case ErrorCode::kDeadlineExceeded:
      return "DEADLINE_EXCEEDED";
    case ErrorCode::kNotFound:
      return "NOT_FOUND";
    case ErrorCode::kAlreadyExists:
      return "ALREADY_EXISTS";
    case ErrorCode::kPermissionDenied:
      return "PERMISSION_DENIED";
    case ErrorCode::kResourceExhausted:
      return "RESOURCE_EXHAUSTED";
    case ErrorCode::kFailedPrecondition:
      return "FAILED_PRECONDITION";
    case ErrorCode::kAborted:
      return "ABORTED";
    case ErrorCode::kOutOfRange:
      return "OUT_OF_RANGE";
    case ErrorCode::kUnimplemented:
      return "UNIMPLEMENTED";
    case ErrorCode::kInternal:
      return "INTERNAL";
    case ErrorCode::kUnavailable:
      return "UNAVAILABLE";
    case ErrorCode::kDataLoss:
      return "DATA_LOSS";
    case ErrorCode::kUnauthenticated:
      return "UNAUTHENTICATED";
  }
  return "UNKNOWN";
}

Error::Error(ErrorDetails details)
    : std::runtime_error(OneLine(details)),
      details_(std::make_shared<const ErrorDetails>(std::move(details))) {}

ErrorDetails DecodeStatus(const grpc::Status& status) {
  ErrorDetails details;
  const int code = status.error_code();
  details.code = code >= 1 && code <= 16 ? static_cast<ErrorCode>(code) : ErrorCode::kUnknown;
  details.message = status.error_message();
  google::rpc::Status rich;
  if (status.error_details().empty() || !rich.ParseFromString(status.error_details())) {
    return details;
  }
  if (!rich.message().empty()) details.message = rich.message();
  for (const auto& any : rich.details()) DecodeDetail(any, &details);
  return details;
}

void Throw(ErrorDetails details) {
  if (IsSessionLost(details)) throw SessionLost(std::move(details));
  if (IsStateLost(details)) throw StateLost(std::move(details));
  throw Error(std::move(details));
}

void ThrowIfFailed(const grpc::Status& status) {
  if (!status.ok()) Throw(DecodeStatus(status));
}

void AddLoss(uint64_t told_step, ErrorDetails* details) {
  if (told_step == 0 || (!IsSessionLost(*details) && !IsStateLost(*details))) return;
  details->metadata["told_step"] = std::to_string(told_step);
  details->message += "; the last answer to a Step was about step " + std::to_string(told_step);
}

Error LocalError(ErrorCode code, std::string reason, std::string message) {
  ErrorDetails details;
  details.code = code;
  details.reason = std::move(reason);
  details.message = std::move(message);
  details.domain = kClientDomain;
  return Error(std::move(details));
}

Error BadField(std::string field, std::string description) {
  ErrorDetails details;
  details.code = ErrorCode::kInvalidArgument;
  details.reason = "BAD_FIELD";
  details.message = field + ": " + description;
  details.domain = kClientDomain;
  details.violations.push_back({std::move(field), std::move(description)});
  return Error(std::move(details));
}

Error Below(const std::string& path, const Error& error) {
  ErrorDetails details = error.details();
  if (details.violations.empty()) details.message = path + ": " + details.message;
  std::string fields;
  for (FieldViolation& violation : details.violations) {
    violation.field = path + "." + violation.field;
    fields += (fields.empty() ? "" : "; ") + violation.field + ": " + violation.description;
  }
  if (!fields.empty()) details.message = std::move(fields);
  return Error(std::move(details));
}

std::string NumberText(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

}  // namespace client
}  // namespace drape
