// Finds the colliders that cloths can meet within a step (collider_reach.h).
#pragma once

#include <cstdint>
#include <vector>

#include "server/solver/cpu/step/collider_reach.h"
#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Adds the colliders that particles of a cloth in this state may touch within a step to `near`,
// which stays ascending. Returns where its free particles are expected to stay if not all are:
// nothing there touches the others.
ParticleBox AddNear(const StepContext& context, const FloatState& state,
                    std::vector<uint32_t>& near);

// Whether edges of the cloth may touch a collider within the step, if it is near; and whether one
// is.
bool HasCollidersForEdges(const StepContext& context);
bool MayTouchEdges(const StepContext& context, const FloatState& state);

// For a cloth alone, before its step.
void FindReach(const StepContext& context, const FloatState& state, ColliderReach& reach);

// All colliders count as near.
void ReachAll(const StepContext& context, ColliderReach& reach);

}  // namespace drape::cpu
