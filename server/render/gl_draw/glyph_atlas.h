// The characters of the legends as one image.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace drape::render {

// The rectangle of a character in the image, and its position relative to the pen, which is on the
// base line. [px]
struct Glyph {
  uint32_t left = 0;
  uint32_t top = 0;
  uint32_t width = 0;
  uint32_t height = 0;
  float offset_x = 0;  // of the image's left edge, to the right of the pen
  float offset_y = 0;  // of its upper edge, below the base line (mostly negative)
  float advance = 0;
};

// The printable characters of ASCII in one size; '-' looks like a minus. Constant after Bake.
class GlyphAtlas {
 public:
  // Draws the embedded font (font.h). `size_px`: from the top of the tallest to the foot of the
  // lowest character, 4 to 200.
  static GlyphAtlas Bake(uint32_t size_px);

  uint32_t size_px() const { return size_px_; }
  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  const std::vector<uint8_t>& texels() const { return texels_; }  // [height][width], 255: covered

  // Other characters are shown as '?'.
  const Glyph& GlyphOf(char character) const;
  float WidthOf(std::string_view text) const;
  // Width of a digit [px].
  float digit_height() const { return digit_height_; }

 private:
  static constexpr int kFirst = 32;
  static constexpr int kCount = 95;

  uint32_t size_px_ = 0;
  uint32_t width_ = 0;
  uint32_t height_ = 0;
  float digit_height_ = 0;
  std::vector<uint8_t> texels_;
  std::array<Glyph, kCount> glyphs_ = {};
};

}  // namespace drape::render
