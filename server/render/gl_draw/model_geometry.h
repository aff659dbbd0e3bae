// The arrays of words that the drawing shaders read of a scene model. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape::render {

// Word offsets of the arrays that shaders/interface/draw_records.h names.
struct GeometryLayout {
  // Offsets in `surface`.
  uint32_t corner_offsets = 0;
  uint32_t corners = 0;
  // Offsets in `constraints`.
  uint32_t end_offsets = 0;
  uint32_t ends = 0;
  uint32_t constraints = 0;
  uint32_t pins = 0;
};

struct ModelGeometry {
  GeometryLayout layout;
  std::vector<uint32_t> indices;      // [triangle_count][3]
  std::vector<uint32_t> surface;      // empty without triangles
  std::vector<uint32_t> constraints;  // with the pins
};

ModelGeometry BuildGeometry(const SceneModel& model);

}  // namespace drape::render
