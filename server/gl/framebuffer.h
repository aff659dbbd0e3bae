// The images that are drawn into.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/core/status.h"

namespace drape::gl {

// Owns a picture with one or four samples per pixel and a depth for each sample, which a shader
// reads, and an image of the same size for what it makes of them: a colour and a number. 8 bits of
// sRGB and an alpha that is linear; with GL_FRAMEBUFFER_SRGB shaders write linear values, and
// blending is done in linear light, without it they write what is stored. Move-only; its context
// must be current in every call.
class PictureTarget {
 public:
  // `samples`: 1 or 4. RESOURCE_EXHAUSTED (DEVICE_MEMORY) if the device has no room or cannot draw
  // pictures of this size.
  static Result<PictureTarget> Create(uint32_t width_px, uint32_t height_px, uint32_t samples);
  ~PictureTarget();
  PictureTarget(PictureTarget&& other) noexcept { *this = std::move(other); }
  PictureTarget& operator=(PictureTarget&& other) noexcept;

  uint32_t width_px() const { return width_px_; }
  uint32_t height_px() const { return height_px_; }
  uint32_t samples() const { return samples_; }
  // Pictures have these lowest rows only.
  uint32_t row_count() const { return row_count_; }
  void UseRows(uint32_t row_count);

  // Subsequent draws go into the samples.
  void Begin() const;
  // Subsequent draws go into the image that is read: its first output is a colour, as it is to be
  // stored, the second the number. The samples are bound to these texture units, colours as they
  // are stored.
  void BeginPacking(GLuint colour_unit, GLuint depth_unit) const;
  // [rows][width_px][3], the lowest row first. Waits for the device.
  std::vector<uint8_t> ReadColours() const;
  // [rows][width_px], the lowest row first. Waits for the device.
  std::vector<float> ReadNumbers() const;

 private:
  enum Texture { kColour, kDepth, kStoredColour, kPackedColour, kPackedNumber, kTextureCount };

  PictureTarget() = default;
  void MakeTextures();
  bool IsComplete() const;
  template <class T>
  std::vector<T> ReadPixels(GLenum attachment, GLenum format, GLenum type, size_t channels) const;

  uint32_t width_px_ = 0;
  uint32_t height_px_ = 0;
  uint32_t row_count_ = 0;
  uint32_t samples_ = 1;
  std::array<GLuint, 2> framebuffers_ = {};  // samples, packed
  std::array<GLuint, kTextureCount> textures_ = {};
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
