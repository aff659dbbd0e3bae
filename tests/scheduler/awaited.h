// A value that one thread waits for.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace drape {

// Hands a value from one thread to another that waits for it. Copies share one value.
template <class T>
class Awaited {
 public:
  void Set(T value) {
    const std::lock_guard lock(shared_->mutex);
    shared_->value = std::move(value);
    shared_->changed.notify_all();
  }
  bool has_value() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->value.has_value();
  }
  // Waits; the reference stays valid as long as a copy of this exists.
  T& Get() const {
    std::unique_lock lock(shared_->mutex);
    shared_->changed.wait(lock, [this] { return shared_->value.has_value(); });
    return *shared_->value;
  }

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<T> value;
  };
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
};

}  // namespace drape
