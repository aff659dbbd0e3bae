#include "client/src/errors.h"

#include <gmock/gmock.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <gtest/gtest.h>

namespace drape {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

google::rpc::Status RichStatus() {
  google::rpc::Status rich;
  rich.set_code(grpc::StatusCode::INVALID_ARGUMENT);
  rich.set_message("2 fields are wrong");
  google::rpc::ErrorInfo info;
  info.set_reason("BAD_SPEC");
  info.set_domain("drape");
  (*info.mutable_metadata())["limit"] = "7";
  rich.add_details()->PackFrom(info);
  google::rpc::BadRequest bad_request;
  for (const char* field : {"spec.pins[2].particle", "spec.grid.rows"}) {
    auto* violation = bad_request.add_field_violations();
    violation->set_field(field);
    violation->set_description("is wrong");
  }
  rich.add_details()->PackFrom(bad_request);
  return rich;
}

grpc::Status ToGrpc(const google::rpc::Status& rich) {
  return grpc::Status(static_cast<grpc::StatusCode>(rich.code()), rich.message(),
                      rich.SerializeAsString());
}

TEST(ErrorsTest, DecodesReasonAndEveryField) {
  const ErrorDetails details = DecodeStatus(ToGrpc(RichStatus()));
  EXPECT_EQ(details.code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(details.message, "2 fields are wrong");
  EXPECT_EQ(details.reason, "BAD_SPEC");
  EXPECT_EQ(details.domain, "drape");
  EXPECT_EQ(details.metadata.at("limit"), "7");
  ASSERT_EQ(details.violations.size(), 2u);
  EXPECT_EQ(details.violations[0].field, "spec.pins[2].particle");
  EXPECT_EQ(details.violations[1].field, "spec.grid.rows");
  EXPECT_EQ(details.violations[1].description, "is wrong");
  EXPECT_FALSE(details.retry_after.has_value());
}

TEST(ErrorsTest, DecodesQuotaAndRetry) {
  google::rpc::Status rich;
  rich.set_code(grpc::StatusCode::RESOURCE_EXHAUSTED);
  google::rpc::QuotaFailure quota;
  quota.add_violations()->set_subject("particles");
  quota.mutable_violations(0)->set_description("all in use");
  rich.add_details()->PackFrom(quota);
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(1);
  retry.mutable_retry_delay()->set_nanos(250'000'000);
  rich.add_details()->PackFrom(retry);
  const ErrorDetails details = DecodeStatus(ToGrpc(rich));
  EXPECT_THAT(details.quotas, ElementsAre("particles: all in use"));
  ASSERT_TRUE(details.retry_after.has_value());
  EXPECT_EQ(details.retry_after->count(), 1250);
}

TEST(ErrorsTest, WhatIsOneLineWithCodeReasonAndFields) {
  const Error error(DecodeStatus(ToGrpc(RichStatus())));
  EXPECT_STREQ(error.what(),
               "INVALID_ARGUMENT (BAD_SPEC): 2 fields are wrong; spec.pins[2].particle: is wrong; "
               "spec.grid.rows: is wrong");
}

TEST(ErrorsTest, WhatIsBelowIsNamedFromAbove) {
  const Error fields = Below("cloths[3]", Error(DecodeStatus(ToGrpc(RichStatus()))));
  EXPECT_EQ(fields.violations()[1].field, "cloths[3].spec.grid.rows");
  EXPECT_STREQ(fields.what(),
               "INVALID_ARGUMENT (BAD_SPEC): cloths[3].spec.pins[2].particle: is wrong; "
               "cloths[3].spec.grid.rows: is wrong");
  const Error quota = Below("cloths[3]", LocalError(ErrorCode::kResourceExhausted, "FULL", "no"));
  EXPECT_STREQ(quota.what(), "RESOURCE_EXHAUSTED (FULL): cloths[3]: no");
}

TEST(ErrorsTest, AStatusWithoutReadableDetailsKeepsCodeAndMessage) {
  for (const std::string& bytes : {std::string(), std::string("\xff\xff rubbish")}) {
    const ErrorDetails details =
        DecodeStatus(grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone", bytes));
    EXPECT_EQ(details.code, ErrorCode::kUnavailable);
    EXPECT_EQ(details.message, "gone");
    EXPECT_TRUE(details.reason.empty());
  }
}

TEST(ErrorsTest, ThrowsOnlyForFailures) {
  EXPECT_NO_THROW(ThrowIfFailed(grpc::Status::OK));
  EXPECT_THROW(ThrowIfFailed(grpc::Status(grpc::StatusCode::NOT_FOUND, "no")), Error);
}

TEST(ErrorsTest, ABadFieldIsNamedOnce) {
  const Error error = BadField("spec.grid", "is wrong");
  EXPECT_STREQ(error.what(), "INVALID_ARGUMENT (BAD_FIELD): spec.grid: is wrong");
  ASSERT_EQ(error.violations().size(), 1u);
  EXPECT_EQ(error.violations()[0].field, "spec.grid");
}

TEST(ErrorsTest, EveryCodeHasItsCanonicalName) {
  EXPECT_EQ(ErrorCodeName(ErrorCode::kCancelled), "CANCELLED");
  EXPECT_EQ(ErrorCodeName(ErrorCode::kUnauthenticated), "UNAUTHENTICATED");
  for (int code = 1; code <= 16; ++code) {
    if (code == static_cast<int>(ErrorCode::kUnknown)) continue;
    EXPECT_NE(ErrorCodeName(static_cast<ErrorCode>(code)), "UNKNOWN") << code;
  }
}

}  // namespace
}  // namespace drape
