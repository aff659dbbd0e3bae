// Which cloths can share lanes although they hold different particles (../side_by_side/lanes.md).
#pragma once

#include <cstdint>

#include "server/scene/scene_model.h"

namespace drape::cpu {

// Whether lanes can step a cloth of `model` by the particles, links, elements and strips of
// `layout`, with inverse masses of its own: but for what follows from the pins the models are the
// same, and at each particle that `model` leaves free its strips come in the same order. About
// linear in the constraints.
bool FitsLayout(const SceneModel& model, const SceneModel& layout);

// Equal for models of which one fits the other.
uint64_t LayoutHash(const SceneModel& model);

}  // namespace drape::cpu
