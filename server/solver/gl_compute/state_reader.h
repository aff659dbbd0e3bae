// Brings columns of many cloths back in few transfers.
#pragma once

#include <cstdint>
#include <span>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/gl/program.h"
#include "server/solver/gl_compute/step_plans.h"

namespace drape {

// A run of words of the block States.
struct StateColumn {
  uint32_t begin = 0;
  uint32_t count = 0;
};

// Every call with the context current. Its buffers have a fixed size, so that reading cannot fail.
class StateReader {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY). `pack` must outlive it.
  static Result<StateReader> Create(const gl::Program* pack, int64_t max_bytes,
                                    const DispatchLimits& limits);

  // The columns one after another into `packed`, whose size is the sum of theirs.
  void Read(const gl::Buffer& states, std::span<const StateColumn> columns,
            std::span<float> packed);

 private:
  StateReader(const gl::Program* pack, gl::Buffer items, gl::Buffer packed, DispatchLimits limits)
      : pack_(pack), items_(std::move(items)), packed_(std::move(packed)), limits_(limits) {}
  void Transfer(const gl::Buffer& states, std::span<const shader::PackItem> items,
                std::span<float> packed);

  const gl::Program* pack_;
  gl::Buffer items_;
  gl::Buffer packed_;
  DispatchLimits limits_;
};

}  // namespace drape
