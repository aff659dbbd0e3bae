// Stages `solve_joints` and `solve_velocity` of joints (server/solver/method.md).
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// One sweep over all point joints. Returns whether an error was larger than the tolerance.
bool SolveJoints(const StepContext& context);

// One sweep over the velocities that rigid joints forbid.
void SolveJointVelocities(const StepContext& context);

}  // namespace drape::cpu
