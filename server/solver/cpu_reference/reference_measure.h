// What a report asks for about a state. Pure.
#pragma once

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_report.h"

namespace drape {

// Stage `measure`, all but max_residual_m, which belongs to the solve and not to the state.
Measurements MeasureState(const SceneModel& model, const ClothParameters& parameters,
                          const ParticleState& state);

}  // namespace drape
