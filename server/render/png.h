// PNG files.
#pragma once

#include <string>

#include "server/core/status.h"
#include "server/render/picture_spec.h"

namespace drape::render {

// The whole file, 8-bit sRGB. RESOURCE_EXHAUSTED (DEVICE_MEMORY) when there is no memory for it.
Result<std::string> EncodePng(const Picture& picture);

}  // namespace drape::render
