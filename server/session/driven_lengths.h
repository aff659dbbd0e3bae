// The cloths that get rest lengths of their own, and how many: of every constraint, also of those
// that the pins of the moment leave out.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/scheduler/step_controls.h"
#include "server/session/cloth_record.h"
#include "server/session/held_charge.h"
#include "server/session/saved_states.h"

namespace drape {

// Those that the controls drive; a cloth may occur several times. `becoming` as in ResolveControls.
std::vector<CountedCloth> DrivenBy(
    const StepControls& controls, std::span<const std::shared_ptr<ClothRecord>> cloths,
    std::span<const std::shared_ptr<const ClothDescription>> becoming);
// Those that go on from a cloth whose lengths were driven.
std::vector<CountedCloth> DrivenBy(std::span<const LoadPair> pairs);

}  // namespace drape
