// The OpenGL device of a backend: context, memory, kernels.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/core/status.h"
#include "server/gl/context.h"
#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/gl_tuning.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/state_reader.h"
#include "server/solver/gl_compute/step_batch.h"

namespace drape {

// Members in order of construction.
struct GlDevice {
  // On the calling thread. Errors as CreateGlBackend.
  static Result<GlDevice> Open(const GlBackendOptions& options, const GlTuning& tuning);

  std::unique_ptr<gl::Context> context;
  std::unique_ptr<DeviceArrays> arrays;
  std::unique_ptr<KernelCache> kernels;
  std::unique_ptr<StateReader> reader;
  MeasureKernels measure;
  DeviceTraits traits;
  BatchDevice batch;
  bool runs_ahead = false;
  uint32_t first_pairs_per_particle = 0;  // of cloths that touch themselves

 private:
  Status CompileGeneralKernels(int64_t max_bytes);
};

}  // namespace drape
