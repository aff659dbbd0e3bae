// Mesh colliders for drawing. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/scene/description.h"

namespace drape::render {

// For every corner of every triangle in turn: position from `center_m` [m], shifted inwards by
// about `inset_m` along the mean normal of the vertex; unit normal, the mean of those faces around
// the vertex that make less than 40 degrees with the corner's own, weighted by area.
// [triangle_count * 3][6], for DRAPE_DRAW_BINDING_SURFACE.
std::vector<float> MeshCorners(const TriangleMesh& mesh, const Eigen::Vector3d& center_m,
                               double inset_m);

}  // namespace drape::render
