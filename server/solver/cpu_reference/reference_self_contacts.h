// The contacts of a cloth with itself (self_contact/), in double precision.
#pragma once

#include <vector>

#include "server/scene/particle_state.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/step_report.h"

namespace drape::reference {

struct StepContext;
using SelfVector = self_contact::Vector3d;

struct ReferenceSelfContacts {
  self_contact::SelfContacts<SelfVector> contacts;
  std::vector<SelfVector> starts;  // positions at the start of the substep
  bool has_failed = false;         // pins forced the cloth through itself
  // With StepContext::impulses, of a substep: self_contact::HeldPulls.
  std::vector<SelfVector> pulls{}, pulls_in_memory{};
};

// Before the first substep. Whether parts of the cloth cross each other. `surface`: of a cloth that
// touches itself; else not used.
bool BeginSelfContacts(StepContext& context, const ContactSurface* surface, bool may_cross);
// What a report says of them.
void MeasureSelfContacts(const ContactSurface& surface, const ClothParameters& parameters,
                         const ParticleState& state, Measurements& measured);

}  // namespace drape::reference
