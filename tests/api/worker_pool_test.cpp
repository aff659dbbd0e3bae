#include "server/api/worker_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <string>
#include <vector>

namespace drape::api {
namespace {

TEST(WorkerPool, RunsEveryTaskThatItTookBeforeItEnds) {
  std::atomic<int> runs = 0;
  {
    WorkerPool pool(2, 1000, 1000);
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(pool.Post("a", [&] { ++runs; }).ok());
  }
  EXPECT_EQ(runs, 100);
}

TEST(WorkerPool, AFullQueueIsRefusedWithAHintWhenToRetry) {
  std::promise<void> go;
  std::promise<void> started;
  WorkerPool pool(1, 2);
  ASSERT_TRUE(pool.Post("a",
                        [&, wait = go.get_future().share()] {
                          started.set_value();
                          wait.wait();
                        })
                  .ok());
  started.get_future().wait();
  EXPECT_TRUE(pool.Post("a", [] {}).ok());
  EXPECT_TRUE(pool.Post("a", [] {}).ok());
  const Status full = pool.Post("a", [] { ADD_FAILURE() << "a refused task was run"; });
  EXPECT_EQ(full.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(full.reason(), "BUILD_QUEUE_FULL");
  EXPECT_TRUE(full.retry_after_ms());
  go.set_value();
}

TEST(WorkerPool, AnOwnerWithManyTasksLeavesRoomForOthers) {
  std::promise<void> go;
  std::promise<void> started;
  std::atomic<int> runs = 0;
  {
    WorkerPool pool(1, 1000, 2);
    ASSERT_TRUE(pool.Post("a",
                          [&, wait = go.get_future().share()] {
                            started.set_value();
                            wait.wait();
                          })
                    .ok());
    started.get_future().wait();
    EXPECT_TRUE(pool.Post("a", [&] { ++runs; }).ok());
    EXPECT_TRUE(pool.Post("a", [&] { ++runs; }).ok());
    const Status full = pool.Post("a", [&] { ++runs; });
    EXPECT_EQ(full.reason(), "BUILD_QUEUE_FULL");
    EXPECT_TRUE(full.retry_after_ms());
    EXPECT_TRUE(pool.Post("b", [&] { ++runs; }).ok());
    go.set_value();
  }
  EXPECT_EQ(runs, 3);
}

// Sixteen long tasks of one owner: another one's does not wait for any of them.
TEST(WorkerPool, OneOwnerNeverHasAllThreads) {
  std::promise<void> go;
  const std::shared_future<void> wait = go.get_future().share();
  std::promise<void> ran;
  WorkerPool pool(2, 1000, 16);
  for (int k = 0; k < 16; ++k) ASSERT_TRUE(pool.Post("greedy", [wait] { wait.wait(); }).ok());
  ASSERT_TRUE(pool.Post("other", [&] { ran.set_value(); }).ok());
  EXPECT_EQ(ran.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
  go.set_value();
}

TEST(WorkerPool, OwnersTakeTurns) {
  std::promise<void> go;
  const std::shared_future<void> wait = go.get_future().share();
  std::promise<void> started_a, started_b;
  std::mutex mutex;
  std::vector<std::string> order;
  {
    WorkerPool pool(1, 1000, 16);  // two threads, both busy at first
    ASSERT_TRUE(pool.Post("a", [&, wait] { started_a.set_value(), wait.wait(); }).ok());
    ASSERT_TRUE(pool.Post("b", [&, wait] { started_b.set_value(), wait.wait(); }).ok());
    started_a.get_future().wait();
    started_b.get_future().wait();
    const auto note = [&](const std::string& owner) {
      return [&, owner] {
        const std::lock_guard lock(mutex);
        order.push_back(owner);
      };
    };
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(pool.Post("c", note("c")).ok());
    ASSERT_TRUE(pool.Post("d", note("d")).ok());
    go.set_value();
  }
  ASSERT_EQ(order.size(), 5u);
  const auto place = std::find(order.begin(), order.end(), "d") - order.begin();
  EXPECT_LE(place, 2) << "not behind all of c's";
}

}  // namespace
}  // namespace drape::api
