// Many small pictures in one.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "server/render/renderer.h"

namespace drape::render {

// Each cloth alone, as the renderer draws it, one below the other: a picture of cloths.size() times
// the height. spec.camera is set, in the environment of each cloth; without spec.range each tile
// has a colour scale of its own. Takes `states` of all cloths, and leaves them as they were.
// CANCELLED between two tiles. Render thread.
Result<Picture> DrawTiles(Renderer& renderer, const PictureSpec& spec,
                          std::span<const DrawnCloth> cloths, DrawnStates& states,
                          const std::function<bool()>& is_cancelled);

}  // namespace drape::render
