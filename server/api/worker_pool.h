// Threads for work that is too long for a gRPC callback: building scene models.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/core/status.h"

namespace drape::api {

// Thread-safe. Tasks start in the order in which they were taken.
class WorkerPool {
 public:
  WorkerPool(uint32_t thread_count, uint32_t max_queued_tasks);
  // Runs what was taken, then ends.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after): the task is dropped.
  Status Post(std::function<void()> task);

 private:
  void Loop();

  const uint32_t max_queued_tasks_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace drape::api
