#include "server/render/gl_draw/glyph_atlas.h"

#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

#include <algorithm>
#include <numeric>

#include "server/core/check.h"
#include "server/render/gl_draw/font.h"

namespace drape::render {

namespace {

constexpr int kMinusSign = 0x2212;
constexpr uint32_t kGap = 1;  // between glyphs [px]

}  // namespace

GlyphAtlas GlyphAtlas::Bake(uint32_t size_px) {
  DRAPE_CHECK(size_px >= 4 && size_px <= 200, "a size for text");
  const auto* file = reinterpret_cast<const unsigned char*>(LegendFont().data());
  stbtt_fontinfo font;
  DRAPE_CHECK(stbtt_InitFont(&font, file, stbtt_GetFontOffsetForIndex(file, 0)) != 0,
              "the embedded font is not one");
  GlyphAtlas atlas;
  atlas.size_px_ = size_px;
  const float scale = stbtt_ScaleForPixelHeight(&font, static_cast<float>(size_px));
  // Rows of 16 characters, left to right.
  atlas.width_ = 16 * (size_px + kGap);
  uint32_t x = 0;
  uint32_t y = 0;
  uint32_t row_height = 0;
  for (int index = 0; index < kCount; ++index) {
    const int code = kFirst + index == '-' ? kMinusSign : kFirst + index;
    int advance = 0;
    int bearing = 0;
    stbtt_GetCodepointHMetrics(&font, code, &advance, &bearing);
    int left = 0, top = 0, right = 0, bottom = 0;
    stbtt_GetCodepointBitmapBox(&font, code, scale, scale, &left, &top, &right, &bottom);
    Glyph& glyph = atlas.glyphs_[static_cast<size_t>(index)];
    glyph.width = static_cast<uint32_t>(right - left);
    glyph.height = static_cast<uint32_t>(bottom - top);
    glyph.offset_x = static_cast<float>(left);
    glyph.offset_y = static_cast<float>(top);
    glyph.advance = scale * static_cast<float>(advance);
    if (x + glyph.width > atlas.width_) {
      x = 0;
      y += row_height + kGap;
      row_height = 0;
    }
    glyph.left = x;
    glyph.top = y;
    x += glyph.width + kGap;
    row_height = std::max(row_height, glyph.height);
    atlas.height_ = y + row_height;
    atlas.texels_.resize(size_t{atlas.width_} * atlas.height_);
    stbtt_MakeCodepointBitmap(&font, &atlas.texels_[size_t{glyph.top} * atlas.width_ + glyph.left],
                              right - left, bottom - top, static_cast<int>(atlas.width_), scale,
                              scale, code);
  }
  atlas.digit_height_ = -atlas.GlyphOf('0').offset_y;
  return atlas;
}

const Glyph& GlyphAtlas::GlyphOf(char character) const {
  const int index = static_cast<unsigned char>(character) - kFirst;
  return glyphs_[static_cast<size_t>(index >= 0 && index < kCount ? index : '?' - kFirst)];
}

float GlyphAtlas::WidthOf(std::string_view text) const {
  return std::accumulate(text.begin(), text.end(), 0.0f, [this](float width, char character) {
    return width + GlyphOf(character).advance;
  });
}

}  // namespace drape::render
