// Strips that a kernel reads without lists, such as the rows and columns of a grid.
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// A strip whose particles are first_particle, first_particle + stride, ... and whose links are all
// of one rest length in single precision, to the bit.
struct RegularStrip {
  uint32_t link_begin = 0;  // as in StripSet
  uint32_t link_end = 0;
  uint32_t first_particle = 0;
  uint32_t stride = 0;  // modulo 2^32: a strip may go down
  float rest_length_m = 0;
};

// The strips of a model if all are regular, in their order; else none. Pure.
std::vector<RegularStrip> FindRegularStrips(const SceneModel& model);

}  // namespace drape
