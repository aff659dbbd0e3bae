// In what order and on which thread answers are given.
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
  // The same, but where nothing waits or runs the function runs at once on the caller's thread:
  // that saves waking the other one.
  void RunOrPush(std::function<void()> function);
  // Runs what is left, those functions that they push included, and joins. Not on the thread
  // itself.
  void Stop();
  bool IsOnThread() const { return std::this_thread::get_id() == thread_id_; }

 private:
  void Loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> functions_;
  bool is_running_ = false;  // one of them, on whichever thread
  bool is_stopping_ = false;
  bool is_stopped_ = false;
  std::thread thread_;
  std::thread::id thread_id_;
};

}  // namespace drape
