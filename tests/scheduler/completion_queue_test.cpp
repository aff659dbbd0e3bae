#include "server/scheduler/completion_queue.h"

#include <gtest/gtest.h>

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

TEST(CompletionQueue, AfterStopThePusherRunsIt) {
  CompletionQueue queue;
  queue.Stop();
  std::thread::id thread;
  queue.Push([&] { thread = std::this_thread::get_id(); });
  EXPECT_EQ(thread, std::this_thread::get_id());
}

}  // namespace
}  // namespace drape
