// The measures of a state for a report. Pure.
#pragma once

#include <span>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_report.h"

namespace drape {

// The reason why a state is not committed.
FaultReason FindFault(const ParticleState& state);

// Stage `measure`, all but max_residual_m and rms_motion_m, which belong to the step and not to the
// state.
// `rest_lengths_m`: [constraint_count], or empty: those of the model.
Measurements MeasureState(const SceneModel& model, const ClothParameters& parameters,
                          const ParticleState& state, std::span<const double> rest_lengths_m = {});

// From the state at the start of a step to that at its end [m].
double RmsMotion(const ParticleState& start, const ParticleState& end);

}  // namespace drape
