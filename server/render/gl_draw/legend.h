// The legend of a picture, as rectangles to draw. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/render/gl_draw/glyph_atlas.h"
#include "server/render/picture_spec.h"
#include "shaders/interface/draw_records.h"

namespace drape::render {

// A mark on the scale with its label.
struct Tick {
  double value = 0;
  std::string label;
};

// At least two and at most five round values (1, 2, 2.5 or 5 times a power of ten apart) within
// [low, high], low < high, ascending.
std::vector<Tick> RoundTicks(double low, double high);

// Height of the text of a picture's legend [px]: 15 in 960 x 720; 0: the picture is too small for
// one (below 320 x 240).
uint32_t LegendTextSize(uint32_t width_px, uint32_t height_px);

// Approximate width of a colour scale at the picture's right side, with margins [px].
double LegendWidth(const PictureSpec& spec);

// The colour scale of `range` (strains in percent); for kColourGroup the colours and numbers of the
// first 16 groups. Empty for kMaterial, and if it does not fit.
std::vector<shader::LabelRecord> LayOutLegend(const PictureSpec& spec, const ValueRange& range,
                                              uint32_t group_count, const GlyphAtlas& glyphs);

}  // namespace drape::render
