// The images that are drawn into.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// Owns a picture with four samples per pixel (fewer if the device has fewer), a depth for each
// sample, and the same with one sample. 8-bit sRGB: shaders write linear values; blending
// and averaging are done in linear light. Move-only; its context must be current in every call.
class PictureTarget {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY) if the device has no room or cannot draw pictures of this
  // size.
  static Result<PictureTarget> Create(uint32_t width_px, uint32_t height_px);
  ~PictureTarget();
  PictureTarget(PictureTarget&& other) noexcept { *this = std::move(other); }
  PictureTarget& operator=(PictureTarget&& other) noexcept;

  uint32_t width_px() const { return width_px_; }
  uint32_t height_px() const { return height_px_; }

  // Subsequent draws go into the multisampled picture.
  void Begin() const;
  // Averages the samples; subsequent draws go over the result.
  void Resolve() const;
  // The depths of one sample of each pixel, for ReadDepths.
  void ResolveDepths() const;
  // The resolved picture: [height_px][width_px][3], sRGB, top row first. Waits for the device.
  std::vector<uint8_t> Read() const;
  // [height_px][width_px] from 0 to 1, top row first. Waits for the device.
  std::vector<float> ReadDepths() const;

 private:
  PictureTarget() = default;
  bool IsComplete() const;
  void Copy(GLbitfield what) const;
  template <class T>
  std::vector<T> ReadPixels(GLenum format, GLenum type, size_t channels) const;

  uint32_t width_px_ = 0;
  uint32_t height_px_ = 0;
  std::array<GLuint, 2> framebuffers_ = {};  // multisampled, one sample
  // Multisampled colour and depth, colour and depth of one sample.
  std::array<GLuint, 4> renderbuffers_ = {};
};

// Owns a square depth texture for comparison in shaders: a shadow map. Nothing beyond its edges is
// in shadow. Move-only; its context must be current in every call.
class DepthMap {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  static Result<DepthMap> Create(uint32_t size_px);
  ~DepthMap();
  DepthMap(DepthMap&& other) noexcept { *this = std::move(other); }
  DepthMap& operator=(DepthMap&& other) noexcept;

  uint32_t size_px() const { return size_px_; }
  // Subsequent draws go into it.
  void Begin() const;
  void BindTexture(GLuint unit) const { glBindTextureUnit(unit, texture_); }

 private:
  DepthMap() = default;

  uint32_t size_px_ = 0;
  GLuint framebuffer_ = 0;
  GLuint texture_ = 0;
};

}  // namespace drape::gl
