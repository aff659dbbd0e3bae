// How finely solid colliders are drawn. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/render/gl_draw/collider_shapes.h"
#include "server/render/picture_spec.h"

namespace drape::render {

// Faces along a quarter of a circle around the solid, so that they are no farther than a fifth of a
// pixel inside it; 1 for a cuboid. At most 48, 24 among more than 8 solids, 12 among more than 64.
uint32_t QuarterFaces(const DrawnSolid& solid, size_t solid_count, const Camera& camera,
                      uint32_t height_px);

// Three indices per triangle of the vertices of shaders/draw/solids.vert.
std::vector<uint32_t> SolidIndices(uint32_t quarter_faces);

}  // namespace drape::render
