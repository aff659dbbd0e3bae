#include "server/api/status_mapping.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <gtest/gtest.h>

#include <optional>

namespace drape::api {
namespace {

google::rpc::Status DetailsOf(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  return details;
}

template <class Detail>
std::optional<Detail> Find(const google::rpc::Status& status) {
  for (const auto& any : status.details()) {
    Detail detail;
    if (any.UnpackTo(&detail)) return detail;
  }
  return {};
}

TEST(StatusMapping, TheTable) {
  const std::pair<StatusCode, grpc::StatusCode> kTable[] = {
      {StatusCode::kOk, grpc::StatusCode::OK},
      {StatusCode::kInvalidArgument, grpc::StatusCode::INVALID_ARGUMENT},
      {StatusCode::kNotFound, grpc::StatusCode::NOT_FOUND},
      {StatusCode::kAlreadyExists, grpc::StatusCode::ALREADY_EXISTS},
      {StatusCode::kFailedPrecondition, grpc::StatusCode::FAILED_PRECONDITION},
      {StatusCode::kAborted, grpc::StatusCode::ABORTED},
      {StatusCode::kResourceExhausted, grpc::StatusCode::RESOURCE_EXHAUSTED},
      {StatusCode::kUnavailable, grpc::StatusCode::UNAVAILABLE},
      {StatusCode::kCancelled, grpc::StatusCode::CANCELLED},
      {StatusCode::kInternal, grpc::StatusCode::INTERNAL},
  };
  for (const auto& [ours, theirs] : kTable) EXPECT_EQ(ToGrpcCode(ours), theirs);
}

TEST(StatusMapping, OkHasNoDetails) {
  const grpc::Status status = ToGrpcStatus(Status::Ok());
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(status.error_details().empty());
}

TEST(StatusMapping, BadRequestNamesEveryField) {
  const grpc::Status status = ToGrpcStatus(
      Status::InvalidFields({{"spec.grid.columns", "0 is not >= 1"}, {"count", "0 is not >= 1"}}));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const google::rpc::Status details = DetailsOf(status);
  EXPECT_EQ(details.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(details.message(), status.error_message());
  const auto error_info = Find<google::rpc::ErrorInfo>(details);
  ASSERT_TRUE(error_info);
  EXPECT_EQ(error_info->reason(), "INVALID_FIELDS");
  EXPECT_EQ(error_info->domain(), "drape");
  const auto bad_request = Find<google::rpc::BadRequest>(details);
  ASSERT_TRUE(bad_request);
  ASSERT_EQ(bad_request->field_violations_size(), 2);
  EXPECT_EQ(bad_request->field_violations(0).field(), "spec.grid.columns");
  EXPECT_EQ(bad_request->field_violations(1).description(), "0 is not >= 1");
  EXPECT_FALSE(Find<google::rpc::RetryInfo>(details));
  EXPECT_FALSE(Find<google::rpc::QuotaFailure>(details));
}

TEST(StatusMapping, FullQueueTellsWhenToRetry) {
  Status full(StatusCode::kResourceExhausted, "QUEUE_FULL", "64 requests wait already");
  const google::rpc::Status details = DetailsOf(ToGrpcStatus(full.RetryAfterMs(1250)));
  const auto retry_info = Find<google::rpc::RetryInfo>(details);
  ASSERT_TRUE(retry_info);
  EXPECT_EQ(retry_info->retry_delay().seconds(), 1);
  EXPECT_EQ(retry_info->retry_delay().nanos(), 250'000'000);
  const auto quota_failure = Find<google::rpc::QuotaFailure>(details);
  ASSERT_TRUE(quota_failure);
  EXPECT_EQ(quota_failure->violations(0).subject(), "QUEUE_FULL");
}

TEST(StatusMapping, MetadataIsForPrograms) {
  const Status status(StatusCode::kResourceExhausted, "SLOW_CONSUMER", "");
  const auto error_info = Find<google::rpc::ErrorInfo>(
      DetailsOf(ToGrpcStatus(status, {{"last_step", "7"}, {"last_frame", "3"}})));
  ASSERT_TRUE(error_info);
  EXPECT_EQ(error_info->metadata().at("last_step"), "7");
  EXPECT_EQ(error_info->metadata().at("last_frame"), "3");
}

// gRPC refuses metadata above 8 KiB: then a client would see no message at all. The message is
// percent-encoded, threefold for bytes outside ASCII.
TEST(StatusMapping, HostileTextsFitIntoTheTrailers) {
  std::string euros;
  for (int k = 0; k < 5000; ++k) euros += "\xE2\x82\xAC";
  const grpc::Status status =
      ToGrpcStatus(Status::InvalidFields(std::vector<FieldViolation>(16, {euros, euros})));
  EXPECT_LT(3 * status.error_message().size() + status.error_details().size(), 8000u);
  const google::rpc::Status details = DetailsOf(status);
  EXPECT_TRUE(details.message().ends_with("..."));
  EXPECT_EQ((details.message().size() - 3) % 3, 0u) << "cut between characters";
  EXPECT_GE(Find<google::rpc::BadRequest>(details)->field_violations_size(), 1);
}

}  // namespace
}  // namespace drape::api
