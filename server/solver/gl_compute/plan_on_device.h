// The plan of a step in the precision of the device.
#pragma once

#include "server/solver/step_plan.h"

namespace drape {

inline StepPlan PlanOnDevice(const SceneModel& model, const ClothParameters& parameters,
                             bool has_own_lengths) {
  return PlanStep(model, parameters, has_own_lengths ? LengthSource::kOwn : LengthSource::kModel,
                  ScalarType::kFloat32);
}

}  // namespace drape
