// The contacts of a cloth with itself: the stages of self_contact/self_contacts.h on the state of a
// step. One thread, the leader's: the pairs are solved one after the other.
#pragma once

#include "server/solver/cpu/step/step_context.h"
#include "server/solver/self_contact/self_contacts.h"

namespace drape::cpu {

struct SelfContactMemory {
  self_contact::SelfContacts<Vec4> contacts;
  std::vector<Vec4> starts;  // of one step: positions at the start of the substep
  // Of a substep, where impulses are asked for: self_contact::HeldPulls.
  std::vector<Vec4> pulls, pulls_in_memory;
};

// Before the first substep, on the state that it starts with. Whether parts of the cloth cross.
bool BeginSelfContacts(const StepContext& context);
// After the prediction.
void FindSelfContacts(const StepContext& context);
bool SolveSelfContacts(const StepContext& context);
// Sweeps of the substep: max_iterations, or more if the last one ended with a hard hit.
uint32_t SweepsAfterHits(const StepContext& context);
// After the integration.
void GuardSelfContacts(const StepContext& context);

}  // namespace drape::cpu
