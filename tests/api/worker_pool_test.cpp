#include "server/api/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

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

}  // namespace
}  // namespace drape::api
