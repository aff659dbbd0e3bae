// Threads for work that is too long for a gRPC callback: building scene models.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/core/status.h"

namespace drape::api {

// Thread-safe. Tasks start in the order in which they were taken.
class WorkerPool {
 public:
  WorkerPool(uint32_t thread_count, uint32_t max_queued_tasks,
             uint32_t max_queued_tasks_per_owner = 16);
  // Runs what was taken, then ends.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after), because too many tasks wait, of all or
  // of this owner: the task is dropped.
  Status Post(const std::string& owner, std::function<void()> task);

 private:
  struct Task {
    std::string owner;
    std::function<void()> run;
  };
  void Loop();

  const uint32_t max_queued_tasks_;
  const uint32_t max_queued_tasks_per_owner_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;
  std::unordered_map<std::string, uint32_t> queued_by_owner_;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace drape::api
