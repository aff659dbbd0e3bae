// The step of a group of cloths under the tiled plan: one dispatch per phase for all of them.
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/step_plans.h"
#include "server/solver/pause.h"
#include "shaders/interface/bindings.h"

namespace drape {

// Dispatches that the tiled plan has arguments for, in a group of cloths with at most as many
// phases and colours each as the model has of all.
uint64_t MostDispatchesOfSweep(const SceneModel& model);

// As StepResident. `dispatches`: arguments of the indirect ones.
uint32_t StepTiled(const VariantGroup& group, const DispatchLimits& limits, gl::Buffer& dispatches);

// How far a tiled step is that is done in pieces; all else is in the cloth's scratch memory and its
// status.
struct TiledProgress {
  // The part of the substep that comes next.
  enum class Part { kBeforeSweeps, kSweeps, kIntegrate, kVelocitySweeps, kAfterSweeps };

  bool has_begun = false;
  uint32_t substep = 0;  // under way
  Part part = Part::kBeforeSweeps;
  uint32_t sweep = 0;            // of the part
  uint32_t dispatches_done = 0;  // of the sweep, or of a part without sweeps
  // After how many dispatches the device is waited for, to know whether the pause is due: enough
  // that the wait counts little, and few enough to be in time.
  uint32_t dispatches_per_look = 1;
  // Arguments of the indirect dispatches, which the device changes, while it pauses.
  std::vector<std::byte> dispatches;
};

// Begins or goes on with the step of one cloth until `pause` is due. False: it paused. Adds to
// `dispatch_count`.
bool ContinueTiled(const VariantGroup& cloth, gl::Buffer& dispatches, TiledProgress& progress,
                   const Pause& pause, uint32_t& dispatch_count);

}  // namespace drape
