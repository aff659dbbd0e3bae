// Whether a step has gained energy.
#pragma once

#include <optional>
#include <span>

#include "server/solver/cpu_reference/reference_self_contacts.h"
#include "server/solver/cpu_reference/reference_step.h"
#include "server/solver/energy_watch.h"

namespace drape::reference {

// Whether all cloths together have gained more than they may, for one may give energy to another,
// or no finite number. What is held and moved does work. `balance`: of a single cloth, if nothing
// else has part in it. Where no calmer scheme is left such a cloth loses what it has gained.
bool GainEnergy(StepContexts& contexts, std::span<const SteppedReference> cloths,
                std::span<const EnergyLimit> limits, bool may_be_calmer,
                std::optional<EnergyBalance>& balance);

}  // namespace drape::reference
