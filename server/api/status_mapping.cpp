#include "server/api/status_mapping.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>

#include <string>
#include <utility>

#include "server/core/text.h"

namespace drape::api {
namespace {

google::rpc::BadRequest BadRequestOf(const Status& status) {
  google::rpc::BadRequest bad_request;
  for (const FieldViolation& violation : status.violations()) {
    google::rpc::BadRequest::FieldViolation entry;
    entry.set_field(Shortened(violation.field, kMaxViolationTextBytes));
    entry.set_description(Shortened(violation.description, kMaxViolationTextBytes));
    if (bad_request.ByteSizeLong() + entry.ByteSizeLong() > kMaxBadRequestBytes) break;
    *bad_request.add_field_violations() = std::move(entry);
  }
  return bad_request;
}

}  // namespace

grpc::StatusCode ToGrpcCode(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return grpc::StatusCode::OK;
    case StatusCode::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case StatusCode::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case StatusCode::kAlreadyExists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case StatusCode::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case StatusCode::kAborted:
      return grpc::StatusCode::ABORTED;
    case StatusCode::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case StatusCode::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case StatusCode::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case StatusCode::kInternal:
      return grpc::StatusCode::INTERNAL;
  }
  return grpc::StatusCode::UNKNOWN;
}

grpc::Status ToGrpcStatus(const Status& status, const StatusMetadata& metadata) {
  if (status.ok()) return grpc::Status::OK;
  const bool is_of_token = status.reason() == kInvalidToken;
  const grpc::StatusCode code =
      is_of_token ? grpc::StatusCode::UNAUTHENTICATED : ToGrpcCode(status.code());
  const std::string message = Shortened(status.message(), kMaxMessageBytes);

  google::rpc::Status details;
  details.set_code(code);
  details.set_message(message);
  google::rpc::ErrorInfo error_info;
  error_info.set_reason(status.reason());
  error_info.set_domain(kErrorDomain);
  error_info.mutable_metadata()->insert(metadata.begin(), metadata.end());
  details.add_details()->PackFrom(error_info);
  if (!status.violations().empty()) details.add_details()->PackFrom(BadRequestOf(status));
  if (status.code() == StatusCode::kResourceExhausted) {
    google::rpc::QuotaFailure quota_failure;
    auto* violation = quota_failure.add_violations();
    violation->set_subject(status.reason());
    violation->set_description(Shortened(status.message(), kMaxViolationTextBytes));
    details.add_details()->PackFrom(quota_failure);
  }
  if (status.retry_after_ms()) {
    google::rpc::RetryInfo retry_info;
    const int64_t delay_ms = *status.retry_after_ms();
    retry_info.mutable_retry_delay()->set_seconds(delay_ms / 1000);
    retry_info.mutable_retry_delay()->set_nanos(static_cast<int32_t>(delay_ms % 1000 * 1'000'000));
    details.add_details()->PackFrom(retry_info);
  }
  return grpc::Status(code, message, details.SerializeAsString());
}

Status ClientHasGone() {
  return Status(StatusCode::kCancelled, "CANCELLED", "the client has gone");
}

}  // namespace drape::api
