// Many small pictures in one.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "server/render/renderer.h"

namespace drape::render {

// Tiles that are drawn together, evenly: as many as have this many pixels and particles, at least
// one. A page takes the device about as long as one picture of ordinary size; larger, others wait
// longer for it; smaller, each tile pays for more of what a page costs however small it is.
inline constexpr uint64_t kMaxPagePixels = uint64_t{1} << 20;
inline constexpr uint64_t kMaxPageParticles = uint64_t{1} << 18;

// How many of `cloths` the next page has, for tiles of that size.
size_t NextPage(const PictureSpec& spec, std::span<const DrawnCloth> cloths);

// Each cloth alone, as the renderer draws it, one below the other: a picture of cloths.size() times
// the height. spec.camera is set, in the environment of each cloth; without spec.range each tile
// has a colour scale of its own. Takes `states` of all cloths, and leaves them as they were.
// Pages for which there is no room are
// halved. CANCELLED between two pages. Render thread.
Result<Picture> DrawTiles(Renderer& renderer, const PictureSpec& spec,
                          std::span<const DrawnCloth> cloths, DrawnStates& states,
                          const std::function<bool()>& is_cancelled);

}  // namespace drape::render
