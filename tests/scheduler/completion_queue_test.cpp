#include "server/scheduler/completion_queue.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>
#include <vector>

namespace drape {
namespace {

TEST(CompletionQueue, RunsInOrderOnAThreadOfItsOwn) {
  std::vector<int> order;
  bool is_on_thread = true;
  CompletionQueue queue;
  for (int k = 0; k < 100; ++k) {
    queue.Push([&, k] {
      order.push_back(k);
      is_on_thread = is_on_thread && queue.IsOnThread();
    });
  }
  queue.Stop();
  ASSERT_EQ(order.size(), 100u);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(order[static_cast<size_t>(k)], k);
  EXPECT_TRUE(is_on_thread);
  EXPECT_FALSE(queue.IsOnThread());
}

TEST(CompletionQueue, StopRunsWhatTheLastFunctionsPush) {
  bool is_run = false;
  CompletionQueue queue;
  queue.Push([&] { queue.Push([&] { is_run = true; }); });
  queue.Stop();
  EXPECT_TRUE(is_run);
}

TEST(CompletionQueue, WhereNothingWaitsTheCallerRunsIt) {
  CompletionQueue queue;
  std::thread::id thread;
  queue.RunOrPush([&] { thread = std::this_thread::get_id(); });
  EXPECT_EQ(thread, std::this_thread::get_id());
}

TEST(CompletionQueue, WhatRunsIsNotOvertaken) {
  CompletionQueue queue;
  std::vector<int> order;
  std::promise<void> may_end;
  queue.Push([&, ended = may_end.get_future().share()] {
    ended.wait();
    order.push_back(0);
  });
  bool is_on_thread = false;
  queue.RunOrPush([&] {
    order.push_back(1);
    is_on_thread = queue.IsOnThread();
  });
  EXPECT_FALSE(is_on_thread);
  may_end.set_value();
  queue.Stop();
  EXPECT_EQ(order, (std::vector{0, 1}));
  EXPECT_TRUE(is_on_thread);
}

TEST(CompletionQueue, TheThreadWaitsForWhatTheCallerRuns) {
  CompletionQueue queue;
  std::vector<int> order;
  queue.RunOrPush([&] {
    queue.Push([&] { order.push_back(1); });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    order.push_back(0);
  });
  queue.Stop();
  EXPECT_EQ(order, (std::vector{0, 1}));
}

TEST(CompletionQueue, AfterStopThePusherRunsIt) {
  CompletionQueue queue;
  queue.Stop();
  std::thread::id thread;
  queue.Push([&] { thread = std::this_thread::get_id(); });
  EXPECT_EQ(thread, std::this_thread::get_id());
}

}  // namespace
}  // namespace drape
