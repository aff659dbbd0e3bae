#include "server/api/worker_pool.h"

#include <string>
#include <utility>

namespace drape::api {
namespace {

constexpr int64_t kRetryAfter_ms = 100;

Status QueueFull(uint32_t count, const char* whose) {
  Status status(StatusCode::kResourceExhausted, "BUILD_QUEUE_FULL",
                std::to_string(count) + " models " + whose + " already wait to be built");
  return status.RetryAfterMs(kRetryAfter_ms);
}

}  // namespace

WorkerPool::WorkerPool(uint32_t thread_count, uint32_t max_queued_tasks,
                       uint32_t max_queued_tasks_per_owner)
    : max_queued_tasks_(max_queued_tasks), max_queued_tasks_per_owner_(max_queued_tasks_per_owner) {
  for (uint32_t k = 0; k < thread_count; ++k) threads_.emplace_back([this] { Loop(); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

Status WorkerPool::Post(const std::string& owner, std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    if (tasks_.size() >= max_queued_tasks_) return QueueFull(max_queued_tasks_, "of all sessions");
    const auto entry = queued_by_owner_.try_emplace(owner, 0).first;
    if (entry->second >= max_queued_tasks_per_owner_) {
      return QueueFull(max_queued_tasks_per_owner_, "of this session");
    }
    ++entry->second;
    tasks_.push_back({owner, std::move(task)});
  }
  wake_.notify_one();
  return Status::Ok();
}

void WorkerPool::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return is_stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    const auto entry = queued_by_owner_.find(task.owner);
    if (--entry->second == 0) queued_by_owner_.erase(entry);
    lock.unlock();
    task.run();
    task = {};
    lock.lock();
  }
}

}  // namespace drape::api
