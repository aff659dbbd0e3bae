#include "server/session/request_memory.h"

#include <gtest/gtest.h>

#include <string>

namespace drape {
namespace {

bool IsNew(RequestMemory& memory, const std::string& id) {
  const Result<std::any> known = memory.Begin(id, 1);
  return known.ok() && !known->has_value();
}

TEST(RequestMemory, ARepeatedRequestGetsTheSameAnswer) {
  RequestMemory memory(4, 1000);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Complete("a", std::string("answer"), 6);
  const Result<std::any> known = memory.Begin("a", 1);
  EXPECT_EQ(std::any_cast<std::string>(*known), "answer");
}

TEST(RequestMemory, ADuplicateOfARequestUnderWayIsAborted) {
  RequestMemory memory(4, 1000);
  EXPECT_TRUE(IsNew(memory, "a"));
  const auto known = memory.Begin("a", 1);
  EXPECT_EQ(known.status().code(), StatusCode::kAborted);
  EXPECT_EQ(known.status().reason(), "REQUEST_IN_PROGRESS");
  EXPECT_EQ(known.status().retry_after_ms(), 50);
}

TEST(RequestMemory, AFailedRequestMayBeTriedAgain) {
  RequestMemory memory(4, 1000);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Abandon("a");
  EXPECT_TRUE(IsNew(memory, "a"));
}

TEST(RequestMemory, AnIdBelongsToOneRequest) {
  RequestMemory memory(4, 1000);
  EXPECT_TRUE(IsNew(memory, "a"));
  EXPECT_EQ(memory.Begin("a", 2).status().violations()[0].field, "request_id");
  memory.Complete("a", 1, 1);
  EXPECT_EQ(memory.Begin("a", 2).status().violations()[0].field, "request_id");
}

TEST(RequestMemory, LongIdsAreRefusedAndEmptyOnesAreNobodys) {
  RequestMemory memory(4, 1000);
  EXPECT_FALSE(memory.Begin(std::string(kMaxRequestIdBytes + 1, 'x'), 1).ok());
  EXPECT_TRUE(IsNew(memory, std::string(kMaxRequestIdBytes, 'x')));
  EXPECT_TRUE(IsNew(memory, ""));
  EXPECT_TRUE(IsNew(memory, ""));
  memory.Complete("", 1, 1);
  EXPECT_TRUE(IsNew(memory, ""));
}

TEST(RequestMemory, TheOldestAnswersAreForgotten) {
  RequestMemory memory(3, 1000);
  for (const char* id : {"a", "b", "c", "d"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 1);
  }
  for (const char* id : {"b", "c", "d"}) EXPECT_FALSE(IsNew(memory, id)) << id;
  EXPECT_TRUE(IsNew(memory, "a"));
}

TEST(RequestMemory, BytesAreBoundedButTheNewestAnswerStays) {
  RequestMemory memory(10, 100);
  EXPECT_TRUE(IsNew(memory, "a"));
  memory.Complete("a", 1, 60);
  EXPECT_TRUE(IsNew(memory, "b"));
  memory.Complete("b", 1, 40);
  EXPECT_FALSE(IsNew(memory, "a"));  // 100 bytes fit
  EXPECT_TRUE(IsNew(memory, "c"));
  memory.Complete("c", 1, 5000);
  EXPECT_FALSE(IsNew(memory, "c"));
  EXPECT_TRUE(IsNew(memory, "a"));
  EXPECT_TRUE(IsNew(memory, "b"));
}

TEST(RequestMemory, RequestsUnderWayAreNeverForgotten) {
  RequestMemory memory(1, 1000);
  EXPECT_TRUE(IsNew(memory, "slow"));
  for (const char* id : {"a", "b"}) {
    EXPECT_TRUE(IsNew(memory, id));
    memory.Complete(id, 1, 1);
  }
  EXPECT_EQ(memory.Begin("slow", 1).status().reason(), "REQUEST_IN_PROGRESS");
}

}  // namespace
}  // namespace drape
