// Where the tiles of a page are in the images that are drawn into. Pure.
#pragma once

#include <cstdint>

#include "shaders/interface/types.h"

namespace drape::render {

// Pixels or texels, from the lower left corner.
struct PixelBox {
  uint32_t x = 0;
  uint32_t y = 0;
  uint32_t width = 0;
  uint32_t height = 0;
};

// A page is one picture, or tiles of one size, one below the other in the picture target. Their
// shadow maps are cells of one square map, in rows from the lower left corner.
struct PageLayout {
  uint32_t tile_count = 1;
  uint32_t width_px = 0;        // of a tile
  uint32_t height_px = 0;       // of a tile
  uint32_t shadow_size_px = 0;  // of a cell

  uint32_t picture_height_px() const { return tile_count * height_px; }
  PixelBox PictureOf(uint32_t tile) const;

  uint32_t shadow_columns() const;
  // Of the map that has all the cells, with gaps between them.
  uint32_t shadow_map_size_px() const;
  PixelBox ShadowOf(uint32_t tile) const;
  // Origin (xy) and size (zw) of the cell in a map of `map_size_px`, as texture coordinates.
  shader::vec4 ShadowCellOf(uint32_t tile, uint32_t map_size_px) const;
};

}  // namespace drape::render
