// A cloth whose step is planned in the precision of the device.
#pragma once

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"

namespace drape {

// Refers to the model and the parameters, which must outlive it.
struct PlannedCloth {
  const SceneModel& model;
  const ClothParameters& parameters;
  LengthSource lengths = LengthSource::kModel;
  StepPlan plan;

  bool has_own_lengths() const { return lengths == LengthSource::kOwn; }
  // Whether kernels judge how contacts slide: the same with one step, or with one coefficient.
  bool has_two_frictions() const {
    return !parameters.colliders.empty() && plan.schedule.has_two_steps() &&
           HasTwoFrictions(parameters);
  }
};

inline PlannedCloth PlanOnDevice(const SceneModel& model, const ClothParameters& parameters,
                                 LengthSource lengths = LengthSource::kModel) {
  return {model, parameters, lengths, PlanStep(model, parameters, lengths, ScalarType::kFloat32)};
}

}  // namespace drape
