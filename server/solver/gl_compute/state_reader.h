// Brings columns of many cloths back in few transfers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/gl/program.h"
#include "server/gl/sync.h"
#include "server/solver/gl_compute/step_plans.h"

namespace drape {

// A run of words of the block States.
struct StateColumn {
  uint32_t begin = 0;
  uint32_t count = 0;
};

// Words of a column, counted from its begin.
struct ColumnRun {
  uint32_t first = 0;
  uint32_t count = 0;
};
// The fewest runs, ascending, that hold the vectors of these particles (strictly ascending).
std::vector<ColumnRun> RunsOf(std::span<const uint32_t> particles);

class StateReader;

// Columns on their way to the host. Move-only; with the context current, before the reader is
// destroyed.
class StateTransfer {
 public:
  // Waits for the device if necessary, and copies the words one after another into `parts`, whose
  // sizes add up to the requested number. Call it once.
  void Take(std::initializer_list<std::span<float>> parts);

 private:
  friend class StateReader;
  StateTransfer(StateReader* reader, size_t word_count)
      : reader_(reader), word_count_(word_count) {}

  StateReader* reader_;
  size_t word_count_;  // 0 once they are taken
  // Either the buffer that the device copies them to or, if there was no room for one, the words.
  std::optional<gl::ReadbackBuffer> memory_;
  gl::Fence fence_;
  std::vector<float> words_;
};

// Every call with the context current. Its buffer on the device has a fixed size, and without room
// for readback buffers it waits for the device at once, so that reading cannot fail.
class StateReader {
 public:
  // No buffer is larger than `max_bytes`. RESOURCE_EXHAUSTED (DEVICE_MEMORY). `pack` must outlive
  // it.
  static Result<StateReader> Create(const gl::Program* pack, int64_t max_bytes,
                                    const DispatchLimits& limits);

  // The columns one after another, as they are after all work submitted before; later work does not
  // change them. `runs`: the parts of each column, inside every column; empty: whole columns.
  StateTransfer Begin(const gl::Buffer& states, std::span<const StateColumn> columns,
                      std::span<const ColumnRun> runs = {});

 private:
  friend class StateTransfer;
  StateReader(const gl::Program* pack, gl::Buffer items, gl::Buffer packed, int64_t max_bytes,
              DispatchLimits limits)
      : pack_(pack),
        items_(std::move(items)),
        packed_(std::move(packed)),
        max_bytes_(static_cast<uint64_t>(max_bytes)),
        limits_(limits) {}
  // A spare buffer that is large enough, or a new one; none if there is no room.
  std::optional<gl::ReadbackBuffer> Memory(size_t size_bytes);
  void Return(gl::ReadbackBuffer memory);
  void Pack(const gl::Buffer& states, std::span<const shader::PackItem> items);

  const gl::Program* pack_;
  gl::Buffer items_;
  gl::Buffer packed_;
  uint64_t max_bytes_;  // of any buffer
  DispatchLimits limits_;
  struct Spare {
    gl::ReadbackBuffer memory;
    uint64_t last_read;  // of read_count_
  };
  std::vector<Spare> spare_;
  uint64_t read_count_ = 0;
};

}  // namespace drape
