// The font of the legends.
#pragma once

#include <cstddef>
#include <span>

namespace drape::render {

// DejaVu Sans, a TrueType file, as it was on the machine that built this. Its licence: README.md.
std::span<const std::byte> LegendFont();

}  // namespace drape::render
