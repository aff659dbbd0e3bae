// The step of a group of cloths under the tiled plan: one dispatch per phase for all of them.
#pragma once

#include <cstdint>

#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/step_plans.h"

namespace drape {

// Dispatches that the tiled plan has arguments for, in a group of cloths with at most as many
// phases and colours each as the model has of all.
uint64_t MostDispatchesOfSweep(const SceneModel& model);

// As StepResident. `dispatches`: arguments of the indirect ones.
uint32_t StepTiled(const VariantGroup& group, const DispatchLimits& limits, gl::Buffer& dispatches);

}  // namespace drape
