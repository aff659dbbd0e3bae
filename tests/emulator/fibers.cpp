#include "tests/emulator/fibers.h"

#include <sys/mman.h>

#include <utility>

#include "server/core/check.h"

namespace drape::emulator {

namespace {

// The argument of makecontext is an int; there is one at a time per thread.
thread_local Fibers* entering = nullptr;

}  // namespace

Fibers::Fibers(uint32_t most) : stack_bytes_(most * kStackBytes), contexts_(most) {
  void* stacks = mmap(nullptr, stack_bytes_, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  DRAPE_CHECK(stacks != MAP_FAILED, "no memory for the stacks of a work group");
  stacks_ = static_cast<std::byte*>(stacks);
}

Fibers::~Fibers() {
  munmap(stacks_, stack_bytes_);
}

void Fibers::Begin(uint32_t count, std::function<void(uint32_t)> body) {
  DRAPE_CHECK(count <= contexts_.size(), "more invocations than fibers");
  body_ = std::move(body);
  has_ended_.assign(count, false);
  for (uint32_t k = 0; k < count; ++k) {
    ucontext_t& context = contexts_[k];
    getcontext(&context);
    context.uc_stack.ss_sp = stacks_ + k * kStackBytes;
    context.uc_stack.ss_size = kStackBytes;
    context.uc_link = &scheduler_;
    makecontext(&context, &Fibers::Enter, 0);
  }
}

void Fibers::Enter() {
  Fibers& fibers = *entering;
  const uint32_t k = fibers.running_;
  fibers.body_(k);
  fibers.has_ended_[k] = true;
}

void Fibers::Run(uint32_t k) {
  entering = this;
  running_ = k;
  swapcontext(&scheduler_, &contexts_[k]);
}

void Fibers::Wait() {
  swapcontext(&contexts_[running_], &scheduler_);
}

}  // namespace drape::emulator
