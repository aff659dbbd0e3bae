#include "server/scheduler/command_queue.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/scheduler/fake_backend.h"

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

// As commands of one owner, named by the order in which they are popped.
std::vector<int> Order(CommandQueue& queue, Backend& backend, std::vector<int>& done) {
  queue.BeginRound();
  while (const auto entry = queue.Pop(0)) entry->command(backend);
  return std::exchange(done, {});
}

TEST(CommandQueue, WhatGoesOnComesBeforeAllOthersOfItsOwner) {
  CommandQueue queue;
  FakeBackend backend(std::make_shared<FakeDevice>());
  std::vector<int> done;
  const auto command = [&](int number) {
    return [&, number](Backend&) { done.push_back(number); };
  };
  queue.Push("a", [&](Backend&) {
    done.push_back(1);
    queue.PushFirst("a", command(4));  // a checkpoint
    queue.PushNext("a", [&](Backend&) {
      done.push_back(2);
      queue.PushNext("a", command(3));
    });
    queue.PushFirst("a", command(5));
  });
  queue.Push("a", command(6));
  queue.Push("b", command(7));
  EXPECT_EQ(Order(queue, backend, done), (std::vector<int>{1, 7}));
  EXPECT_EQ(Order(queue, backend, done), (std::vector<int>{2}));
  EXPECT_EQ(Order(queue, backend, done), (std::vector<int>{3, 5, 4, 6}));
  EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace drape
