// The font of the legends.
#pragma once

#include <cstddef>
#include <span>

namespace drape::render {

// DejaVu Sans as a TrueType file, from the machine that built this. Licence: README.md.
std::span<const std::byte> LegendFont();

}  // namespace drape::render
