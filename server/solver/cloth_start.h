// The start of a cloth among its colliders.
#pragma once

#include <Eigen/Core>
#include <span>

#include "server/scene/scene_model.h"
#include "server/scene/start_clearance.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// ClearOfColliders for the colliders where they are when the cloth is made; up is against gravity.
// With `may_let_out` FitStart after that, from where it led. All in the cloth's own frame.
// Milliseconds to seconds where the cloth is inside; `interruption` is that of
// AvoidedColliders. Any thread.
ClearStart FindClearStart(const SceneModel& model, const ClothParameters& parameters,
                          std::span<const Eigen::Vector3d> positions_m, bool may_let_out = false,
                          Interruption* interruption = nullptr);

}  // namespace drape
