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

// Thread-safe. Owners take turns: a task waits for those of its owner and for one of every other
// owner, never for a queue of theirs. One owner's tasks never take all threads. They start in the
// order in which they were taken.
class WorkerPool {
 public:
  // Starts one thread more than `thread_count`, which is how many tasks of one owner run at once.
  WorkerPool(uint32_t thread_count, uint32_t max_queued_tasks,
             uint32_t max_queued_tasks_per_owner = 16);
  // Runs what was taken, then ends.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after), because too many tasks wait, of all or
  // of this owner: the task is dropped.
  Status Post(const std::string& owner, std::function<void()> task);
  // Tasks that have not started.
  uint32_t queued_count() const;
  uint32_t queued_count(const std::string& owner) const;

 private:
  using Task = std::function<void()>;
  void Loop();
  // --- With mutex_ held.
  // The owner whose task may run next; end: none.
  std::deque<std::string>::iterator NextTurn();
  Task TakeTaskOf(std::deque<std::string>::iterator turn);

  const uint32_t max_running_per_owner_;
  const uint32_t max_queued_tasks_;
  const uint32_t max_queued_tasks_per_owner_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::string> turns_;  // owners with tasks, whose turn comes first in front
  std::unordered_map<std::string, std::deque<Task>> tasks_;  // by owner, never empty
  uint32_t task_count_ = 0;
  std::unordered_map<std::string, uint32_t> running_;  // by owner, never 0
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace drape::api
