// The contacts of cloths with themselves and with those of their world: the stages of
// self_contact/self_contacts.h on the states of a step. One thread, the leader's: the pairs are
// solved one after the other.
#pragma once

#include <optional>
#include <vector>

#include "server/solver/cpu/alone/stepped_cloth.h"
#include "server/solver/cpu/step/expected_flight.h"
#include "server/solver/self_contact/self_contacts.h"

namespace drape::cpu {

// One vector for each particle of all cloths, in the frame of the world.
struct WorldVectors {
  std::vector<Vec4> base, velocities, ends, previous_velocities, previous_positions;
  std::vector<float> inverse_masses;
};

struct SelfContactMemory {
  self_contact::SelfContacts<Vec4> contacts;
  std::vector<float> thicknesses;
  std::vector<self_contact::FrictionNumbers<float>> frictions;
  std::vector<Vec4> starts;  // positions at the start of the substep, where they are not kept
  // Of a substep, where impulses are asked for: self_contact::HeldPulls.
  std::vector<Vec4> pulls, pulls_in_memory;
  // Velocities before a stage, and before the substep, where contacts are asked for.
  std::vector<Vec4> before, before_previous;
  WorldVectors world;  // of several cloths
};

// Whether the cloth touches nothing in the step that is to begin, as far as one can see, and if it
// flies as the result says, which is valid until the working memory of `context` is used again. If
// so, and the cloth does, the stages below would change nothing. It crosses nothing now, and makes
// two steps (server/solver/method.md).
std::optional<ExpectedFlight> ExpectNoContacts(const StepContext& context, const FloatState& state);
// Whether the last step with this working memory found what ExpectNoContacts looks for.
bool FoundNoContacts(const StepScratch& scratch);

// Before the first substep, on the states that it starts with.
void BeginSelfContacts(SteppedCloths cloths);
// Whether parts of a cloth, the `index`th, crossed something when the step began.
bool StartsCrossing(SteppedCloths cloths, size_t index);
// Whether the step under way gave contacts up in some substep (StepWarnings).
bool GaveContactsUp(SteppedCloths cloths);
// Whether anything of them may touch itself or another one of them.
bool MayTouch(SteppedCloths cloths);
// After the prediction.
void FindSelfContacts(SteppedCloths cloths);
bool SolveSelfContacts(SteppedCloths cloths);
// Sweeps of the substep: max_iterations, or more if the last one ended with a hard hit.
uint32_t SweepsAfterHits(SteppedCloths cloths);
// After the integration.
void GuardSelfContacts(SteppedCloths cloths);

}  // namespace drape::cpu
