#include "server/scheduler/command_queue.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace drape {
namespace {

std::vector<std::string> PopAll(CommandQueue& queue, int64_t now_us) {
  std::vector<std::string> owners;
  while (const auto entry = queue.Pop(now_us)) owners.push_back(entry->owner);
  return owners;
}

void Push(CommandQueue& queue, const std::string& owner, int count) {
  for (int k = 0; k < count; ++k) queue.Push(owner, {});
}

using Owners = std::vector<std::string>;

TEST(CommandQueue, OwnersTakeTurns) {
  CommandQueue queue;
  Push(queue, "greedy", 3);
  Push(queue, "modest", 1);
  Push(queue, "other", 2);
  queue.BeginRound();
  EXPECT_EQ(PopAll(queue, 0), (Owners{"greedy", "modest", "other", "greedy", "other", "greedy"}));
  EXPECT_TRUE(queue.empty());
}

TEST(CommandQueue, WhatIsPushedInARoundWaitsForTheNext) {
  CommandQueue queue;
  queue.Push("a", {});
  EXPECT_FALSE(queue.Pop(0).has_value());
  queue.BeginRound();
  EXPECT_TRUE(queue.Pop(0).has_value());
  queue.Push("a", {});
  EXPECT_FALSE(queue.Pop(0).has_value());
  EXPECT_EQ(queue.size(), 1u);
  queue.BeginRound();
  EXPECT_TRUE(queue.Pop(0).has_value());
}

TEST(CommandQueue, WhoRestsLetsOthersPass) {
  CommandQueue queue;
  queue.Rest("greedy", 0, 100);
  Push(queue, "greedy", 2);
  Push(queue, "modest", 1);
  queue.BeginRound();
  EXPECT_EQ(queue.ReadyAt_us(), 0);
  EXPECT_EQ(PopAll(queue, 50), Owners{"modest"});
  EXPECT_EQ(queue.ReadyAt_us(), 100);
  EXPECT_EQ(queue.size_of("greedy"), 2u);
  EXPECT_EQ(PopAll(queue, 100), (Owners{"greedy", "greedy"}));
  EXPECT_EQ(queue.ReadyAt_us(), std::nullopt);
}

TEST(CommandQueue, RestsEndAtOnceWhenAsked) {
  CommandQueue queue;
  queue.Rest("a", 0, 100);
  queue.Push("a", {});
  queue.BeginRound();
  EXPECT_FALSE(queue.Pop(0).has_value());
  queue.EndRests();
  EXPECT_TRUE(queue.Pop(0).has_value());
}

// The rest of an owner without commands is kept until it is over.
TEST(CommandQueue, ARestOutlastsTheCommands) {
  CommandQueue queue;
  queue.Push("a", {});
  queue.BeginRound();
  EXPECT_TRUE(queue.Pop(0).has_value());
  queue.Rest("a", 0, 100);
  queue.Rest("b", 50, 60);
  queue.Push("a", {});
  queue.BeginRound();
  EXPECT_FALSE(queue.Pop(99).has_value());
  EXPECT_TRUE(queue.Pop(100).has_value());
}

}  // namespace
}  // namespace drape
