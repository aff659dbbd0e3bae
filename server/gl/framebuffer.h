// What is drawn into.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// Owns a picture with four samples per pixel (fewer where the device has no more), a depth for each
// of them, and the same picture with one sample. 8-bit sRGB: what shaders write is linear, blending
// and averaging are done in linear light. Move-only; every call with its context current.
class PictureTarget {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY) if the device has no room or does not draw pictures so
  // large.
  static Result<PictureTarget> Create(uint32_t width_px, uint32_t height_px);
  ~PictureTarget();
  PictureTarget(PictureTarget&& other) noexcept { *this = std::move(other); }
  PictureTarget& operator=(PictureTarget&& other) noexcept;

  uint32_t width_px() const { return width_px_; }
  uint32_t height_px() const { return height_px_; }

  // From here on everything is drawn into the many samples.
  void Begin() const;
  // Averages the samples; from here on everything is drawn over that.
  void Resolve() const;
  // The resolved picture: [height_px][width_px][3], sRGB, top row first. Waits for the device.
  std::vector<uint8_t> Read() const;

 private:
  PictureTarget() = default;
  bool IsComplete() const;

  uint32_t width_px_ = 0;
  uint32_t height_px_ = 0;
  std::array<GLuint, 2> framebuffers_ = {};   // of many samples, of one
  std::array<GLuint, 3> renderbuffers_ = {};  // colour and depth of many samples, colour of one
};

// Owns a square depth texture that shaders compare with: a shadow map. Beyond its edges nothing is
// in the shadow. Move-only; every call with its context current.
class DepthMap {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  static Result<DepthMap> Create(uint32_t size_px);
  ~DepthMap();
  DepthMap(DepthMap&& other) noexcept { *this = std::move(other); }
  DepthMap& operator=(DepthMap&& other) noexcept;

  uint32_t size_px() const { return size_px_; }
  // From here on everything is drawn into it.
  void Begin() const;
  void BindTexture(GLuint unit) const { glBindTextureUnit(unit, texture_); }

 private:
  DepthMap() = default;

  uint32_t size_px_ = 0;
  GLuint framebuffer_ = 0;
  GLuint texture_ = 0;
};

}  // namespace drape::gl
