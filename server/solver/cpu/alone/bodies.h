// The parts of `predict`, `solve_contacts`, `integrate` and `correct_velocity` for rigid bodies
// among the colliders (server/solver/bodies). One thread does them: each contact needs what the one
// before it has left of the body.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// At the start of a step; places them in each substep by scratch.bodies.Begin.
void BeginBodies(const StepContext& context);
// From positions and velocities before the substep.
void PredictBodies(const StepContext& context);
// One sweep. Returns whether an impulse was larger than the tolerance.
bool SolveBodies(const StepContext& context);
void IntegrateBodies(const StepContext& context);
void CorrectBodies(const StepContext& context);

}  // namespace drape::cpu
