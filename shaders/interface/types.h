// The GLSL names of types that C++ lacks. Seen by C++ alone.
#pragma once

#include <cstdint>

namespace drape::shader {

using uint = uint32_t;

struct alignas(16) vec4 {
  float x = 0;
  float y = 0;
  float z = 0;
  float w = 0;
};

// Column by column.
struct alignas(16) mat4 {
  float elements[16] = {};
};

}  // namespace drape::shader
