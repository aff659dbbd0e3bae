// Stage `damp_twist`.
#pragma once

#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// Every cell of the grid gives its corners `share` of its twist s = u_00 - u_01 - u_10 + u_11 back,
// with the signs of s: u_00 -= share s, u_01 += share s, ...; all s from the same u, which is
// changed [m/s]. Pins are not. Conserves momentum where the masses are equal, as those of a grid
// are.
void DampTwist(const SceneModel& model, double share, std::vector<Eigen::Vector3d>& u);

}  // namespace drape
