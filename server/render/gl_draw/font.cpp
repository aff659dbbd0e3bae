#include "server/render/gl_draw/font.h"

#include <cstddef>

__asm__(
    ".pushsection .rodata\n"
    ".balign 16\n"
    "drape_legend_font_begin:\n"
    ".incbin \"" DRAPE_FONT_FILE
    "\"\n"
    "drape_legend_font_end:\n"
    ".globl drape_legend_font_begin\n"
    ".globl drape_legend_font_end\n"
    ".popsection\n");

extern "C" {
extern const std::byte drape_legend_font_begin[];
extern const std::byte drape_legend_font_end[];
}

namespace drape::render {

std::span<const std::byte> LegendFont() {
  return {drape_legend_font_begin, drape_legend_font_end};
}

}  // namespace drape::render
