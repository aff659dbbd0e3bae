#include "server/session/request_memory.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

namespace drape {
namespace {

class RequestMemoryTest : public testing::Test {
 protected:
  RequestMemory Memory(uint32_t max_ids, size_t max_answer_bytes,
                       std::shared_ptr<ByteBudget> budget = nullptr) {
    const RequestMemoryLimits limits{1'000'000, max_ids, max_answer_bytes};
    return RequestMemory(limits, clock_, std::move(budget), nullptr, "owner");
  }

  FakeClock clock_;
};

bool IsNew(RequestMemory& memory, const std::string& id) {
  const Result<std::any> known = memory.Begin(id, 1);
  return known.ok() && !known->has_value();
}

TEST_F(RequestMemoryTest, ARepeatedRequestGetsTheSameAnswer) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Complete("a", std::string("answer"), 6);
  const Result<std::any> known = memory.Begin("a", 1);
  EXPECT_EQ(std::any_cast<std::string>(*known), "answer");
}

TEST_F(RequestMemoryTest, ADuplicateOfARequestUnderWayIsAborted) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  const auto known = memory.Begin("a", 1);
  EXPECT_EQ(known.status().code(), StatusCode::kAborted);
  EXPECT_EQ(known.status().reason(), "REQUEST_IN_PROGRESS");
  EXPECT_EQ(known.status().retry_after_ms(), 50);
}

TEST_F(RequestMemoryTest, AFailedRequestMayBeTriedAgain) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Abandon("a");
  EXPECT_TRUE(IsNew(memory, "a"));
}

TEST_F(RequestMemoryTest, WhatIsTooLargeIsDoneOnceWithoutItsAnswer) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  EXPECT_TRUE(memory.Keeps(10'000));
  EXPECT_FALSE(memory.Keeps(10'001));
  memory.CompleteWithoutAnswer("a");
  EXPECT_EQ(memory.Begin("a", 1).status().reason(), "ANSWER_FORGOTTEN");
  clock_.AdvanceUs(1'000'000);
  EXPECT_TRUE(IsNew(memory, "a")) << "ids are kept for a second here";
}

TEST_F(RequestMemoryTest, AnIdBelongsToOneRequest) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  EXPECT_EQ(memory.Begin("a", 2).status().violations()[0].field, "request_id");
  memory.Complete("a", 1, 1);
  EXPECT_EQ(memory.Begin("a", 2).status().violations()[0].field, "request_id");
}

TEST_F(RequestMemoryTest, LongIdsAreRefusedAndEmptyOnesAreNobodys) {
  RequestMemory memory = Memory(4, 10'000);
  EXPECT_FALSE(memory.Begin(std::string(kMaxRequestIdBytes + 1, 'x'), 1).ok());
  EXPECT_TRUE(IsNew(memory, std::string(kMaxRequestIdBytes, 'x')));
  EXPECT_TRUE(IsNew(memory, ""));
  EXPECT_TRUE(IsNew(memory, ""));
  memory.Complete("", 1, 1);
  EXPECT_TRUE(IsNew(memory, ""));
}

// An answer takes 512 bytes besides its own.
TEST_F(RequestMemoryTest, AForgottenAnswerIsNoReasonToDoItAgain) {
  RequestMemory memory = Memory(10, 3 * 512 + 100);
  for (const char* id : {"a", "b", "c"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 40);
  }
  for (const char* id : {"b", "c"}) EXPECT_TRUE(memory.Begin(id, 1)->has_value()) << id;
  const Status forgotten = memory.Begin("a", 1).status();
  EXPECT_EQ(forgotten.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(forgotten.reason(), "ANSWER_FORGOTTEN");
  EXPECT_EQ(memory.Begin("a", 2).status().reason(), "INVALID_FIELDS");
}

TEST_F(RequestMemoryTest, TheNewestAnswerIsKeptWhateverItsSize) {
  RequestMemory memory = Memory(10, 100);
  for (const char* id : {"a", "b"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 5000);
  }
  EXPECT_TRUE(memory.Begin("b", 1)->has_value());
  EXPECT_EQ(memory.Begin("a", 1).status().reason(), "ANSWER_FORGOTTEN");
}

TEST_F(RequestMemoryTest, WhatAllSessionsKeepIsBounded) {
  const auto budget = std::make_shared<ByteBudget>("FULL", ByteBudget::Limit{"each", 100'000},
                                                   ByteBudget::Limit{"all", 4 * 600}, 50);
  RequestMemory memory = Memory(10, 100'000, budget);
  for (const char* id : {"a", "b", "c"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 88);
  }
  EXPECT_EQ(memory.Begin("a", 1).status().reason(), "ANSWER_FORGOTTEN");
  EXPECT_EQ(budget->used_bytes(), 1200u);
  EXPECT_TRUE(IsNew(memory, "large"));
  memory.Complete("large", 1, 5000);
  EXPECT_EQ(memory.Begin("large", 1).status().reason(), "ANSWER_FORGOTTEN");
  EXPECT_EQ(budget->used_bytes(), 0u);
}

TEST_F(RequestMemoryTest, IdsAreKeptForTheirTimeAndNoLonger) {
  RequestMemory memory = Memory(2, 100'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Complete("a", 1, 1);
  clock_.AdvanceUs(600'000);
  EXPECT_TRUE(IsNew(memory, "b"));
  memory.Complete("b", 1, 1);
  const Status full = memory.Begin("c", 1).status();
  EXPECT_EQ(full.reason(), "TOO_MANY_REQUEST_IDS");
  EXPECT_TRUE(full.retry_after_ms().has_value());
  clock_.AdvanceUs(399'999);
  EXPECT_FALSE(IsNew(memory, "a"));
  clock_.AdvanceUs(1);
  EXPECT_TRUE(IsNew(memory, "c"));
  EXPECT_FALSE(IsNew(memory, "b"));
}

// Of 6 ids of one letter half for one alone, and half of the rest for the next one.
TEST_F(RequestMemoryTest, OwnersLeaveRoomForTheIdsOfOthers) {
  constexpr uint64_t kBytesPerId = 323;
  const auto ids =
      std::make_shared<ByteBudget>("TOO_MANY_REQUEST_IDS", ByteBudget::Limit{"half", 1'000'000},
                                   ByteBudget::Limit{"all", 6 * kBytesPerId}, 1000);
  const RequestMemoryLimits limits{1'000'000, 100, 10'000};
  const auto memory_of = [&](const std::string& owner) {
    return std::make_unique<RequestMemory>(limits, clock_, nullptr, ids, owner);
  };
  // Of one tenant: more sessions give no more.
  const auto first = memory_of("greedy"), second = memory_of("greedy");
  const auto other = memory_of("other"), third = memory_of("third");
  EXPECT_TRUE(IsNew(*first, "a"));
  EXPECT_TRUE(IsNew(*second, "a"));
  EXPECT_TRUE(IsNew(*second, "b"));
  const Status refused = first->Begin("b", 1).status();
  EXPECT_EQ(refused.reason(), "TOO_MANY_REQUEST_IDS");
  EXPECT_TRUE(refused.retry_after_ms().has_value());
  EXPECT_EQ(first->Begin("a", 1).status().reason(), "REQUEST_IN_PROGRESS") << "it is known";
  EXPECT_TRUE(IsNew(*other, "a"));
  EXPECT_FALSE(other->Begin("c", 1).ok() && other->Begin("d", 1).ok());
  EXPECT_TRUE(IsNew(*third, "a"));
  for (const char* id : {"a", "b"}) second->Complete(id, 1, 1);
  clock_.AdvanceUs(1'000'000);
  second->ForgetOld();
  EXPECT_EQ(ids->used_bytes("greedy"), kBytesPerId);
  EXPECT_TRUE(IsNew(*first, "b"));
}

TEST_F(RequestMemoryTest, RequestsUnderWayAreNeverForgotten) {
  RequestMemory memory = Memory(10, 100);
  EXPECT_TRUE(IsNew(memory, "slow"));
  for (const char* id : {"a", "b"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 1);
  }
  clock_.AdvanceUs(10'000'000);
  EXPECT_TRUE(IsNew(memory, "a"));
  EXPECT_EQ(memory.Begin("slow", 1).status().reason(), "REQUEST_IN_PROGRESS");
}

}  // namespace
}  // namespace drape
