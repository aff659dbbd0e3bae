// From a RenderRequest to what a picture shows, or INVALID_ARGUMENT with every violation. Pure.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drape/v1/render.pb.h"
#include "server/core/status.h"
#include "server/render/picture_spec.h"

namespace drape::api {

// Legal size of a picture.
inline constexpr uint32_t kMinPictureEdge_px = 16;
inline constexpr uint32_t kMaxPictureEdge_px = 4096;
// Most pixels of all tiles of a request: those of the largest picture.
inline constexpr uint64_t kMaxTiledPixels = uint64_t{1} << 24;  // with depths, half of that

// Everything but session and cloth ids. Directions come out as unit vectors.
Result<render::PictureSpec> CheckRender(const v1::RenderRequest& request);
// Whether the tiles of so many cloths are small enough together.
Status CheckTiles(const render::PictureSpec& spec, size_t cloth_count);

}  // namespace drape::api
