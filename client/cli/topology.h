// The connections between the particles of a cloth, for files that show its surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"

namespace drape::cli {

// Triangles where there is a surface, else lines, else nothing (points). Particle indices.
struct Topology {
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<std::array<uint32_t, 2>> lines;
};

// Grids: two triangles per cell, counter-clockwise seen from above the rest shape; a single row or
// column gives lines. Meshes: their triangles. Particles: a line per distance constraint. Indices
// are those of the spec, unchecked: a server has accepted it.
Topology TopologyOf(const v1::ClothSpec& spec);

}  // namespace drape::cli
