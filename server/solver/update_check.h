// Whether what is written to a cloth fits it: the last check before a backend packs it. Pure.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/core/status.h"
#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/backend.h"

namespace drape {

// Every list of `update` against the model and the colliders that the cloth has afterwards; now it
// has `model` and `parameters`. INTERNAL (SIZES_DISAGREE) names the list: a mistake of the server,
// for which one request is refused and the cloths of all the others live on.
Status CheckUpdateFits(const SceneModel& model, const ClothParameters& parameters,
                       const ClothUpdate& update);

// The same for a new cloth.
Status CheckStateFits(const SceneModel& model, const ClothParameters& parameters,
                      const ParticleState& state);

}  // namespace drape
