#include "server/scheduler/completion_queue.h"

#include <utility>

#include "server/core/check.h"
#include "server/core/trace.h"

namespace drape {

CompletionQueue::CompletionQueue() : thread_([this] { Loop(); }), thread_id_(thread_.get_id()) {}

CompletionQueue::~CompletionQueue() {
  Stop();
}

void CompletionQueue::Push(std::function<void()> function) {
  {
    const std::lock_guard lock(mutex_);
    if (!is_stopped_) {
      functions_.push_back(std::move(function));
      wake_.notify_one();
      return;
    }
  }
  function();
}

void CompletionQueue::RunOrPush(std::function<void()> function) {
  {
    const std::lock_guard lock(mutex_);
    if (!is_stopped_ && (is_running_ || !functions_.empty())) {
      functions_.push_back(std::move(function));
      wake_.notify_one();
      return;
    }
    is_running_ = true;
  }
  function();
  function = nullptr;  // as in Loop
  const std::lock_guard lock(mutex_);
  is_running_ = false;
  if (is_stopping_ || !functions_.empty()) wake_.notify_one();
}

void CompletionQueue::Stop() {
  DRAPE_CHECK(!IsOnThread(), "the completion thread cannot wait for itself");
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void CompletionQueue::Loop() {
  trace::NameThread("completion");
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return !is_running_ && (is_stopping_ || !functions_.empty()); });
    if (functions_.empty()) break;
    std::function<void()> function = std::move(functions_.front());
    functions_.pop_front();
    is_running_ = true;
    lock.unlock();
    {
      const trace::Span span("completion");
      function();
    }
    function = nullptr;  // destroys its captures before the next one runs, without the lock
    lock.lock();
    is_running_ = false;
  }
  is_stopped_ = true;
}

}  // namespace drape
