// One batch on the device: upload, dispatch per variant, measure, read back the statuses.
#pragma once

#include <functional>
#include <span>

#include "server/solver/backend.h"
#include "server/solver/gl_compute/cloth_table.h"
#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/step_plans.h"

namespace drape {

// What of the device matters to a batch.
struct BatchDevice {
  DispatchLimits limits;
  bool has_timer_queries =
      false;                // else the host's clock, which is right where the device is the CPU
  uint32_t look_pause = 0;  // GlBackendOptions::look_pause
  std::function<void(uint32_t)> on_left_out;  // GlBackendOptions::on_left_out
};

// Steps the items, marks cloths that blew up as faulted, and returns the reports. Pin targets are
// in the arrays already. `meanwhile`, if any, is called once the device has its work. With the
// context current.
BatchReport RunBatch(std::span<const StepItem> items, GlClothTable& cloths, DeviceArrays& arrays,
                     KernelCache& kernels, const MeasureKernels& measure, const BatchDevice& device,
                     const std::function<void()>& meanwhile);

}  // namespace drape
