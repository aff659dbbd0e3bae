// The invocations of a work group as fibers: each runs until it waits or ends.
#pragma once

#include <ucontext.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace drape::emulator {

class Fibers {
 public:
  explicit Fibers(uint32_t most);
  ~Fibers();
  Fibers(const Fibers&) = delete;
  Fibers& operator=(const Fibers&) = delete;

  // `body(k)` is what fiber k does; nothing runs yet.
  void Begin(uint32_t count, std::function<void(uint32_t)> body);
  // Runs fiber k until it waits or ends.
  void Run(uint32_t k);
  // Called by the fiber that runs: back to whoever called Run.
  void Wait();
  bool has_ended(uint32_t k) const { return has_ended_[k]; }

 private:
  static void Enter();

  static constexpr size_t kStackBytes = 512 * 1024;
  std::byte* stacks_ = nullptr;
  size_t stack_bytes_ = 0;
  ucontext_t scheduler_{};
  std::vector<ucontext_t> contexts_;
  std::vector<bool> has_ended_;
  std::function<void(uint32_t)> body_;
  uint32_t running_ = 0;
};

}  // namespace drape::emulator
