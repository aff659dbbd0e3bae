// From a RenderRequest to what a picture shows, or INVALID_ARGUMENT with every violation. Pure.
#pragma once

#include "drape/v1/render.pb.h"
#include "server/core/status.h"
#include "server/render/picture_spec.h"

namespace drape::api {

// Legal size of a picture.
inline constexpr uint32_t kMinPictureEdge_px = 16;
inline constexpr uint32_t kMaxPictureEdge_px = 4096;

// Everything but session and cloth ids. Directions come out as unit vectors.
Result<render::PictureSpec> CheckRender(const v1::RenderRequest& request);

}  // namespace drape::api
