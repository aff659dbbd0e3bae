// Colours that distinguish things. Pure; linear RGB.
#pragma once

#include <cstdint>

#include "shaders/interface/types.h"

namespace drape::render {

// From an sRGB value such as 0x2a9d8f; w is 1.
shader::vec4 LinearFromHex(uint32_t srgb);

// Colour of the cloth with this index; a few muted colours in rotation.
shader::vec4 ClothColour(uint32_t cloth_index);

// Colour of a group of constraints: ten hues that are easy to distinguish, then new ones without
// end.
shader::vec4 GroupColour(uint32_t group);

}  // namespace drape::render
