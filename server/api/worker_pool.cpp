#include "server/api/worker_pool.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/core/trace.h"

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
    : max_running_per_owner_(thread_count),
      max_queued_tasks_(max_queued_tasks),
      max_queued_tasks_per_owner_(max_queued_tasks_per_owner) {
  for (uint32_t k = 0; k < thread_count + 1; ++k) threads_.emplace_back([this] { Loop(); });
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
    if (task_count_ >= max_queued_tasks_) return QueueFull(max_queued_tasks_, "of all sessions");
    const auto [tasks, is_new] = tasks_.try_emplace(owner);
    if (tasks->second.size() >= max_queued_tasks_per_owner_) {
      return QueueFull(max_queued_tasks_per_owner_, "of this session");
    }
    if (is_new) turns_.push_back(owner);
    tasks->second.push_back([posted_us = trace::Now_us(), run = std::move(task)] {
      trace::Waited("build_queue", posted_us);
      const trace::Span span("build");
      run();
    });
    ++task_count_;
  }
  wake_.notify_one();
  return Status::Ok();
}

uint32_t WorkerPool::queued_count() const {
  const std::lock_guard lock(mutex_);
  return task_count_;
}

uint32_t WorkerPool::queued_count(const std::string& owner) const {
  const std::lock_guard lock(mutex_);
  const auto tasks = tasks_.find(owner);
  return tasks == tasks_.end() ? 0 : static_cast<uint32_t>(tasks->second.size());
}

std::deque<std::string>::iterator WorkerPool::NextTurn() {
  return std::find_if(turns_.begin(), turns_.end(), [this](const std::string& owner) {
    const auto running = running_.find(owner);
    return running == running_.end() || running->second < max_running_per_owner_;
  });
}

WorkerPool::Task WorkerPool::TakeTaskOf(std::deque<std::string>::iterator turn) {
  const std::string owner = std::move(*turn);
  turns_.erase(turn);
  const auto tasks = tasks_.find(owner);
  Task task = std::move(tasks->second.front());
  tasks->second.pop_front();
  --task_count_;
  ++running_[owner];
  if (tasks->second.empty()) {
    tasks_.erase(tasks);
  } else {
    turns_.push_back(owner);
  }
  return [this, owner, run = std::move(task)]() mutable {
    run();
    run = {};
    const std::lock_guard lock(mutex_);
    const auto running = running_.find(owner);
    if (--running->second == 0) running_.erase(running);
    wake_.notify_all();
  };
}

void WorkerPool::Loop() {
  trace::NameThread("builder");
  std::unique_lock lock(mutex_);
  while (true) {
    auto turn = turns_.end();
    wake_.wait(lock, [&] {
      turn = NextTurn();
      return turn != turns_.end() || (is_stopping_ && task_count_ == 0);
    });
    if (turn == turns_.end()) return;
    Task task = TakeTaskOf(turn);
    lock.unlock();
    task();
    task = {};
    lock.lock();
  }
}

}  // namespace drape::api
