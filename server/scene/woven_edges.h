// Where the edges of a mesh lie between the threads of a woven cloth.
#pragma once

#include <vector>

#include "server/scene/mesh.h"

namespace drape {

// c^2 s^2 for the angle between an edge and the warp in the plane of a triangle, c its cosine and s
// its sine: 0 along warp and weft, 1/4 halfway between them. The mean over the triangles beside the
// edge. The warp runs along the projection of `warp_direction` (of any length) on the triangle;
// where the triangle is steeper than 45 degrees against it, along the projection of a direction
// across it, which is the x axis for the y axis. So cloth that hangs and cloth that lies both have
// threads along the axes. Pure; any thread.
double BiasOf(const MeshEdge& edge, const std::vector<Eigen::Vector3d>& positions_m,
              const Eigen::Vector3d& warp_direction);

}  // namespace drape
