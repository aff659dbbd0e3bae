#include "server/api/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
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
  std::promise<void> go_a, go_b, started_a, started_b, ran_all;
  std::vector<std::string> order;  // of the one thread that a leaves free while b keeps the other
  WorkerPool pool(1, 1000, 16);
  ASSERT_TRUE(pool.Post("a", [&] { started_a.set_value(), go_a.get_future().wait(); }).ok());
  ASSERT_TRUE(pool.Post("b", [&] { started_b.set_value(), go_b.get_future().wait(); }).ok());
  started_a.get_future().wait();
  started_b.get_future().wait();
  const auto note = [&](const std::string& owner) {
    return [&, owner] {
      order.push_back(owner);
      if (order.size() == 5) ran_all.set_value();
    };
  };
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(pool.Post("c", note("c")).ok());
  ASSERT_TRUE(pool.Post("d", note("d")).ok());
  go_a.set_value();
  ran_all.get_future().wait();
  go_b.set_value();
  EXPECT_EQ(order, (std::vector<std::string>{"c", "d", "c", "c", "c"}));
}

}  // namespace
}  // namespace drape::api
