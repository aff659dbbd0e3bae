// Where work that takes long may stop: a stage of a step, or what a builder makes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace drape {

// Thrown within work that is left undone.
struct WorkStopped {};

// Asked within the work by the thread that leads it. No result depends on what it does.
class Interruption {
 public:
  // May keep the calling thread for a while, or throw WorkStopped.
  virtual void Check() = 0;

 protected:
  ~Interruption() = default;
};

// Null: nobody is asked.
inline void Ask(Interruption* interruption) {
  if (interruption != nullptr) interruption->Check();
}

// Stops the work once nobody wants its result.
class StopWhenUnwanted final : public Interruption {
 public:
  explicit StopWhenUnwanted(std::function<bool()> is_unwanted)
      : is_unwanted_(std::move(is_unwanted)) {}

  void Check() override {
    if (is_unwanted_()) throw WorkStopped();
  }

 private:
  const std::function<bool()> is_unwanted_;
};

// Asks once in so many times: for loops whose bodies are short.
class SeldomInterruption {
 public:
  // Null: nobody is asked.
  explicit SeldomInterruption(Interruption* interruption) : interruption_(interruption) {}

  void Check() {
    if (--left_ > 0) return;
    left_ = kTimes;
    Ask(interruption_);
  }

 private:
  static constexpr uint32_t kTimes = 8192;  // a body takes about a tenth of a microsecond

  Interruption* const interruption_;
  uint32_t left_ = kTimes;
};

// list.resize(size, value) in pieces, with between() after each: the pages of hundreds of megabytes
// take long to come.
template <class T, class Between>
void ResizeInPieces(std::vector<T>& list, size_t size, const Between& between,
                    const T& value = T()) {
  constexpr size_t kAtOnce = size_t{1} << 17;
  list.reserve(size);
  while (list.size() + kAtOnce < size) {
    list.resize(list.size() + kAtOnce, value);
    between();
  }
  list.resize(size, value);
}

}  // namespace drape
