// Looks at cloths after a batch, to find out whether they are at rest.
#pragma once

#include <memory>
#include <span>

#include "server/scheduler/cloth_runtime.h"
#include "server/solver/backend.h"

namespace drape {

// Reads the positions of those whose watch wants them; cloths of a world fall asleep together.
// `cloths` have ended a step, those of a world side by side. Device thread.
void LookAtCloths(Backend& backend, std::span<const std::shared_ptr<ClothRuntime>> cloths);

}  // namespace drape
