// Which failures are followed by another sending, after how long, and for how long at all.
#include "client/src/retries.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <set>

namespace drape {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

ErrorDetails Failure(ErrorCode code, const std::string& reason = "",
                     std::optional<milliseconds> retry_after = std::nullopt) {
  ErrorDetails details;
  details.code = code;
  details.reason = reason;
  details.retry_after = retry_after;
  return details;
}

const ErrorDetails kNoAnswer = Failure(ErrorCode::kUnavailable);

TEST(RetriesTest, PausesDoubleUpToALimitGiveOrTakeAFifth) {
  RetryOptions options;
  options.max_tries = 8;
  RetryBudget budget(1000);
  std::set<nanoseconds> firsts;
  for (int k = 0; k < 50; ++k) {
    Tries tries(options, budget, Twice::kIsKnown);
    for (const int nominal_ms : {100, 200, 400, 800, 1600, 2000, 2000}) {
      const auto pause = tries.PauseAfter(kNoAnswer);
      ASSERT_TRUE(pause.has_value());
      EXPECT_GE(*pause, milliseconds(nominal_ms) * 0.8);
      EXPECT_LE(*pause, milliseconds(nominal_ms) * 1.2);
      if (nominal_ms == 100) firsts.insert(*pause);
    }
    EXPECT_EQ(tries.PauseAfter(kNoAnswer), std::nullopt) << "that was the last one";
    EXPECT_EQ(tries.unanswered(), 7u);
  }
  EXPECT_GT(firsts.size(), 25u) << "all clients come back at the same moment";
}

TEST(RetriesTest, WhatTheServerHasDecidedIsFinal) {
  const RetryOptions options;
  RetryBudget budget(1000);
  for (const ErrorDetails& details :
       {Failure(ErrorCode::kFailedPrecondition, "STEP_MISMATCH"),
        Failure(ErrorCode::kNotFound, "SESSION_NOT_FOUND"),
        Failure(ErrorCode::kInvalidArgument, "INVALID_FIELDS"),
        Failure(ErrorCode::kResourceExhausted, "QUOTA_EXCEEDED"),
        Failure(ErrorCode::kDeadlineExceeded), Failure(ErrorCode::kCancelled),
        Failure(ErrorCode::kAborted, "TRACE_IN_PROGRESS")}) {
    Tries tries(options, budget, Twice::kIsKnown);
    EXPECT_EQ(tries.PauseAfter(details), std::nullopt) << details.reason;
  }
}

TEST(RetriesTest, WhoAsksToWaitHasDoneNothing) {
  const RetryOptions options;
  RetryBudget budget(1000);
  for (const Twice twice : {Twice::kReadsAgain, Twice::kIsKnown, Twice::kDoesAgain}) {
    Tries tries(options, budget, twice);
    const auto pause =
        tries.PauseAfter(Failure(ErrorCode::kResourceExhausted, "QUEUE_FULL", milliseconds(300)));
    ASSERT_TRUE(pause.has_value());
    EXPECT_GE(*pause, milliseconds(300));
    EXPECT_LE(*pause, milliseconds(360));
    EXPECT_EQ(tries.unanswered(), 0u);
    EXPECT_EQ(tries.PauseAfter(kNoAnswer).has_value(), twice != Twice::kDoesAgain);
  }
}

TEST(RetriesTest, OnlyChangesThatMayHaveArrivedAreInDoubt) {
  const RetryOptions options;
  RetryBudget budget(1000);
  ErrorDetails refused = kNoAnswer;
  refused.message = "failed to connect to all addresses; last error: Connection refused";
  for (const Twice twice : {Twice::kReadsAgain, Twice::kIsKnown, Twice::kDoesAgain}) {
    Tries tries(options, budget, twice);
    EXPECT_TRUE(tries.PauseAfter(refused).has_value()) << "nobody has seen it";
    EXPECT_EQ(tries.unanswered(), 0u);
    EXPECT_FALSE(tries.IsInDoubt(refused));
    EXPECT_FALSE(tries.IsInDoubt(Failure(ErrorCode::kUnavailable, "DRAINING")));
    EXPECT_FALSE(tries.IsInDoubt(Failure(ErrorCode::kInvalidArgument)));
    EXPECT_EQ(tries.IsInDoubt(kNoAnswer), twice != Twice::kReadsAgain);
    EXPECT_EQ(tries.PauseAfter(kNoAnswer).has_value(), twice != Twice::kDoesAgain);
    EXPECT_EQ(tries.unanswered(), twice == Twice::kIsKnown ? 1u : 0u);
    EXPECT_EQ(tries.IsInDoubt(kNoAnswer), twice == Twice::kDoesAgain) << "the count says it";
  }
}

TEST(RetriesTest, ARequestUnderWayIsWaitedForAsLongAsItTakes) {
  RetryOptions options;
  options.max_tries = 2;
  RetryBudget budget(0);
  Tries tries(options, budget, Twice::kIsKnown);
  const auto under_way = Failure(ErrorCode::kAborted, "REQUEST_IN_PROGRESS", milliseconds(100));
  for (int k = 0; k < 1000; ++k) ASSERT_TRUE(tries.PauseAfter(under_way).has_value());
  options.max_tries = 1;
  Tries once(options, budget, Twice::kIsKnown);
  EXPECT_EQ(once.PauseAfter(under_way), std::nullopt) << "retries are off";
}

TEST(RetriesTest, TheBudgetEndsAtItsHalfAndComesBackWithAnswers) {
  RetryBudget budget(10);
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(budget.Take()) << k;
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(budget.Take()) << k;
  for (int k = 0; k < 60; ++k) budget.Refill();  // from 0 to 6
  EXPECT_FALSE(budget.Take()) << "5 is the half";
  for (int k = 0; k < 1000; ++k) budget.Refill();
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(budget.Take()) << "never more than the whole";
  EXPECT_FALSE(budget.Take());
}

TEST(RetriesTest, AStepIsRepeatableByItsIdOrByItsGuard) {
  v1::StepRequest request;
  request.set_steps(3);
  EXPECT_EQ(IfSentTwice(request), Twice::kDoesAgain);
  request.set_expected_step(5);
  EXPECT_EQ(IfSentTwice(request), Twice::kIsKnown);
  request.mutable_pin_controls()->add_cloth_ids(1);
  EXPECT_EQ(IfSentTwice(request), Twice::kDoesAgain) << "the controls would act once more";
  request.set_request_id("a");
  EXPECT_EQ(IfSentTwice(request), Twice::kIsKnown);
  v1::StepRequest until;
  until.set_until_step(7);
  EXPECT_EQ(IfSentTwice(until), Twice::kIsKnown);
  until.mutable_resets();
  EXPECT_EQ(IfSentTwice(until), Twice::kDoesAgain);
  until.clear_resets();
  until.mutable_loads();
  EXPECT_EQ(IfSentTwice(until), Twice::kDoesAgain);
}

TEST(RetriesTest, ChangesNeedAnIdAndReadsNeedNone) {
  EXPECT_EQ(IfSentTwice(v1::GetClothRequest()), Twice::kReadsAgain);
  EXPECT_EQ(IfSentTwice(v1::RenderRequest()), Twice::kReadsAgain);
  EXPECT_EQ(IfSentTwice(v1::ReadStatesRequest()), Twice::kReadsAgain);
  EXPECT_EQ(IfSentTwice(v1::ExportClothsRequest()), Twice::kReadsAgain);
  EXPECT_EQ(IfSentTwice(v1::ListTenantsRequest()), Twice::kReadsAgain);
  EXPECT_EQ(IfSentTwice(v1::DrainRequest()), Twice::kDoesAgain);
  EXPECT_EQ(IfSentTwice(v1::CreateSessionRequest()), Twice::kDoesAgain);
  EXPECT_EQ(IfSentTwice(v1::DeleteSessionRequest()), Twice::kDoesAgain);
  v1::DeleteClothsRequest request;
  EXPECT_EQ(IfSentTwice(request), Twice::kDoesAgain);
  request.set_request_id("a");
  EXPECT_EQ(IfSentTwice(request), Twice::kIsKnown);
}

TEST(RetriesTest, NoTwoIdsAreTheSame) {
  RequestIds some, others;
  std::set<std::string> ids;
  for (int k = 0; k < 100; ++k) {
    ids.insert(some.Next());
    ids.insert(others.Next());
  }
  EXPECT_EQ(ids.size(), 200u);
}

}  // namespace
}  // namespace drape
