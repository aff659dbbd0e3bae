// Stages `solve_contacts` and `correct_velocity`, and what they need at the start of a substep.
#pragma once

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// Places the moving colliders that are near where they are in a substep from `begin_s` to `end_s`
// of the step.
void PlaceColliders(const StepContext& context, uint32_t index, double substep_s);

// From positions and velocities before the substep.
void PredictContacts(const StepContext& context);

// Again where contacts let the substep end, after refinement has moved particles. With two steps
// the floors are those of the state before the substep.
void FindContactFloors(const StepContext& context);

// One sweep. Returns whether an impulse was larger than the tolerance.
bool SolveContacts(const StepContext& context);

// The same of one free particle, with those colliders that are near.
void SolveContactsOfParticle(const StepContext& context, uint32_t particle);

// Contacts: no approach velocity, rebounds, Coulomb friction; then damping.
void CorrectVelocity(const StepContext& context);

}  // namespace drape::cpu
