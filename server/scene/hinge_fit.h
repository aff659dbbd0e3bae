// How stiff each hinge of a mesh must be for its patches to bend as a plate does, whatever the
// pattern of the triangles is (server/solver/method.md, "apply_elastic").
#pragma once

#include <span>

#include "server/core/interruption.h"
#include "server/scene/elastic_elements.h"

namespace drape {

// Multiplies the stiffness of `hinges`, which are as Hinge() returns them with this rigidity, by
// factors between 0.1 and 3, so that around every inner vertex the energy of a curve, in any
// direction within the sheet, is as close to that of the plate as hinges can make it. Within two
// edges of the rim they stay as they are: what vertices give way more there makes up for what they
// are too stiff (strips four cells wide of irregular meshes bend as the elastica). Linear time.
// `interruption`: asked now and then; null: nobody is. Any thread.
void FitHingesToPlate(std::span<const Eigen::Vector3d> positions_m, double rigidity_n_m,
                      std::span<ElasticElement> hinges, Interruption* interruption = nullptr);

}  // namespace drape
