// How strong springs and elastic elements may be for the substep that they act in.
#pragma once

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// h^2 omega^2 [-] of the fastest elastic element of a cloth. Above 1 the substep cannot follow the
// element, which is softened until this is 1 (server/solver/method.md, "apply_elastic").
double ElasticRatio(const SceneModel& model, const ClothParameters& parameters);

// Whether explicit springs may be unstable: velocity Verlet needs h^2 omega^2 < 4, two steps with
// the springs at the predicted positions less than the square of the golden ratio. Elastic elements
// use up their part of that.
bool AreSpringsBeyondLimit(const SceneModel& model, const ClothParameters& parameters,
                           bool has_two_steps);

// Largest rate at which springs in the force may gain energy [1/s], without constraints; <= 0: they
// gain none. A mode of frequency w and damping d/k = s is multiplied per substep by the matrix of x
// += h v + h^2 a/2, v += h a, a = -w^2 (x + s v), whose determinant is the factor of the squared
// amplitude: 1 + w^2 h (h/2 - s). It grows with w. Damping of the cloth takes exp(-c h).
double SpringGain_per_s(const SceneModel& model, const ClothParameters& parameters);

}  // namespace drape
