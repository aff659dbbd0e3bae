// The thread that gives answers, in order.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace drape {

// Runs functions one after the other, in order, on a thread of its own unless stated otherwise.
// Thread-safe.
class CompletionQueue {
 public:
  CompletionQueue();
  // Stop.
  ~CompletionQueue();
  CompletionQueue(const CompletionQueue&) = delete;
  CompletionQueue& operator=(const CompletionQueue&) = delete;

  // After Stop: runs the function at once on the caller's thread.
  void Push(std::function<void()> function);
  // Like Push, but runs the function at once on the caller's thread if no other one waits or runs:
  // that saves waking the queue's thread.
  void RunOrPush(std::function<void()> function);
  // Runs the remaining functions and those that they push, and joins. Not on the queue's thread.
  void Stop();
  bool IsOnThread() const { return std::this_thread::get_id() == thread_id_; }

 private:
  void Loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> functions_;
  bool is_running_ = false;  // a function, on either thread
  bool is_stopping_ = false;
  bool is_stopped_ = false;
  std::thread thread_;
  std::thread::id thread_id_;
};

}  // namespace drape
