// Stages `predict` and `integrate` of one cloth.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// The velocities of the free particles become u, with two steps their positions b; pins start on
// their way. Needs the accelerations if springs are in the force.
void Predict(const StepContext& context);

// `predicted` = b + `interval` u of all particles.
void PredictPositions(const StepContext& context, float interval);

// The end of the substep of all particles.
void Integrate(const StepContext& context);

}  // namespace drape::cpu
