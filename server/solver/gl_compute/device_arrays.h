// All storage that kernels see, by block (shaders/interface/bindings.h).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/solver/gl_compute/device_arena.h"
#include "server/solver/gl_compute/mirrored_buffer.h"
#include "server/solver/gl_compute/scratch_pool.h"
#include "shaders/interface/batch_item.h"
#include "shaders/interface/cloth_record.h"
#include "shaders/interface/cloth_status.h"
#include "shaders/interface/dispatch_args.h"

namespace drape {

// Every call with the context current. Does not move: ranges point into it.
struct DeviceArrays {
  // Each array is at most `max_bytes` long. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  static Result<std::unique_ptr<DeviceArrays>> Create(int64_t max_bytes);

  // Room for a batch of `cloths` cloths and for `dispatches_of_sweep` dispatches of a sweep.
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY); nothing changes then.
  Status ReserveBatch(uint64_t cloths, uint64_t dispatches_of_sweep);
  // Everything a step reads and writes, but for Scratch, of which each dispatch sees one array.
  void BindForStep() const;

  MirroredBuffer cloths;  // [slot] ClothRecord
  DeviceArena models;
  DeviceArena states;
  MirroredArena parameters;
  ScratchPool scratch;
  gl::Buffer items;     // [] BatchItem: cloths to step, those to measure, those that tell impulses
  gl::Buffer statuses;  // [] ClothStatus
  // Where the host reads them: a buffer that the host asks for may be moved off the device.
  gl::ReadbackBuffer read_statuses;
  gl::Buffer dispatches;  // [] DispatchArgs

 private:
  explicit DeviceArrays(MirroredBuffer cloth_records, DeviceArena model_arena,
                        DeviceArena state_arena, MirroredArena parameter_arena,
                        ScratchPool scratch_pool, int64_t max_bytes)
      : cloths(std::move(cloth_records)),
        models(std::move(model_arena)),
        states(std::move(state_arena)),
        parameters(std::move(parameter_arena)),
        scratch(std::move(scratch_pool)),
        max_bytes_(max_bytes) {}
  Status ReserveBuffer(gl::Buffer& buffer, uint64_t size_bytes) const;

  int64_t max_bytes_;
};

}  // namespace drape
