#include "server/api/worker_pool.h"

#include <string>
#include <utility>

namespace drape::api {
namespace {

constexpr int64_t kRetryAfter_ms = 100;

}  // namespace

WorkerPool::WorkerPool(uint32_t thread_count, uint32_t max_queued_tasks)
    : max_queued_tasks_(max_queued_tasks) {
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

Status WorkerPool::Post(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    if (tasks_.size() >= max_queued_tasks_) {
      Status status(StatusCode::kResourceExhausted, "BUILD_QUEUE_FULL",
                    std::to_string(max_queued_tasks_) + " models wait to be built already");
      return status.RetryAfterMs(kRetryAfter_ms);
    }
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
  return Status::Ok();
}

void WorkerPool::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return is_stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
  }
}

}  // namespace drape::api
