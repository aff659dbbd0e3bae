// The contacts of the insides of edges and triangles with colliders: surface_contact/ on the states
// of a step. One thread, the leader's: the contacts are solved one after the other.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::cpu {

struct SurfaceContactMemory {
  surface_contact::SurfaceContacts<Vec4> contacts;
};

// Before the first substep, when the colliders in reach are known.
void BeginSurfaceContacts(const StepContext& context);
// Before the prediction.
void FindSurfaceContacts(const StepContext& context);
// One sweep. Returns whether an impulse was larger than the tolerance.
bool SolveSurfaceContacts(const StepContext& context);
// After the integration.
void AdvanceSurfaceContacts(const StepContext& context);
// Whether the step had no room for some of them.
bool GaveSurfaceContactsUp(const StepContext& context);
// Beside CorrectVelocity.
void CorrectSurfaceContacts(const StepContext& context);

}  // namespace drape::cpu
