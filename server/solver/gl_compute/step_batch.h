// One batch on the device: upload, dispatch per variant, measure, read back the statuses.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "server/solver/backend.h"
#include "server/solver/gl_compute/cloth_table.h"
#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/step_plans.h"
#include "server/solver/gl_compute/tiled_step.h"
#include "server/solver/pause.h"
#include "shaders/interface/cloth_status.h"

namespace drape {

// The properties of the device that matter to a batch.
struct BatchDevice {
  DispatchLimits limits;
  // Otherwise the host's clock is read, which is right if the device is the CPU.
  bool has_timer_queries = false;
  std::function<void(uint32_t)> on_left_out;  // GlTuning::on_left_out
};

// Steps the items, marks cloths that blew up as faulted, and returns the reports. A cloth that
// must_step_again then is as before, and has none. Pin targets are in the arrays already.
// `meanwhile`, if any, is called once the device has its work. With the context current.
BatchReport RunBatch(std::span<const StepItem> items, GlClothTable& cloths, DeviceArrays& arrays,
                     const MeasureKernels& measure, const BatchDevice& device,
                     const std::function<void()>& meanwhile);

// The step of one cloth that is done in pieces.
struct LongStep {
  uint64_t part = 0;  // of the resident plan
  TiledProgress tiled;
  std::optional<shader::ClothStatus> status;  // while it pauses; none: it has not begun
};

// RunBatch of one cloth that is not faulted, in pieces: begins or goes on until `pause` is due;
// none: it paused.
std::optional<BatchReport> RunPiece(const StepItem& item, GlClothTable& cloths,
                                    DeviceArrays& arrays, const MeasureKernels& measure,
                                    const BatchDevice& device, LongStep& step, const Pause& pause);

}  // namespace drape
