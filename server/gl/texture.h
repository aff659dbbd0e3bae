// Images for shaders.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <span>
#include <utility>

#include "server/core/status.h"

namespace drape::gl {

// Owns one texture of one byte per texel, not filtered; shaders see 0..1 in the red channel.
// Move-only; its context must be current in every call.
class GreyTexture {
 public:
  // `texels`: [height][width], first row at the texture coordinate 0. RESOURCE_EXHAUSTED
  // (DEVICE_MEMORY).
  static Result<GreyTexture> Create(uint32_t width, uint32_t height,
                                    std::span<const uint8_t> texels);
  ~GreyTexture();
  GreyTexture(GreyTexture&& other) noexcept { *this = std::move(other); }
  GreyTexture& operator=(GreyTexture&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }

  void Bind(GLuint unit) const { glBindTextureUnit(unit, name_); }

 private:
  GreyTexture() = default;

  GLuint name_ = 0;
};

}  // namespace drape::gl
