#include "server/render/gl_draw/page_layout.h"

#include <cmath>

namespace drape::render {

namespace {

// Texels between two cells, in which nothing casts a shadow: the taps of the filter reach at most
// 1.5 texels and the half one of the linear filter beyond the edge of a cell (light.glsl). Smaller,
// a tile would see the shadows of its neighbour.
constexpr uint32_t kShadowGap_px = 4;

}  // namespace

PixelBox PageLayout::PictureOf(uint32_t tile) const {
  return {0, (tile_count - 1 - tile) * height_px, width_px, height_px};
}

uint32_t PageLayout::shadow_columns() const {
  return static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(tile_count))));
}

uint32_t PageLayout::shadow_map_size_px() const {
  return shadow_columns() * (shadow_size_px + kShadowGap_px) - kShadowGap_px;
}

PixelBox PageLayout::ShadowOf(uint32_t tile) const {
  const uint32_t pitch_px = shadow_size_px + kShadowGap_px;
  return {tile % shadow_columns() * pitch_px, tile / shadow_columns() * pitch_px, shadow_size_px,
          shadow_size_px};
}

shader::vec4 PageLayout::ShadowCellOf(uint32_t tile, uint32_t map_size_px) const {
  const PixelBox cell = ShadowOf(tile);
  const auto share = [map_size_px](uint32_t texels) {
    return static_cast<float>(static_cast<double>(texels) / map_size_px);
  };
  return {share(cell.x), share(cell.y), share(cell.width), share(cell.height)};
}

}  // namespace drape::render
