// Stage `solve_joints` and rest lengths of a cloth's own (server/solver/method.md).
#pragma once

#include <span>
#include <vector>

#include "server/solver/cpu/cloth_step.h"

namespace drape::cpu {

// One sweep over all point joints. Returns whether an error was larger than the tolerance.
bool SolveJoints(const StepContext& context);

// One sweep over the velocities that rigid joints forbid.
void SolveJointVelocities(const StepContext& context);

// C + (alpha/h) Lambda of joint `index`, with C from the positions of `state` [m].
Lanes JointResidual(const StepContext& context, const FloatState& state, size_t index);

// The lengths at the end of this substep into the scratch memory. Needs own lengths.
void AdvanceLengths(const StepContext& context);

// Lengths in the order of the source [m], packed into the places of the groups.
std::vector<Lanes> PackLengths(const FloatModel& model, std::span<const double> rest_lengths_m);

// What MeasureStrain and MaxResidual call the rest length of constraint c: at the end of the step.
double RestLengthAtEnd(const StepContext& context, size_t c);

}  // namespace drape::cpu
