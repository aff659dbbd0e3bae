// Device memory.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <span>
#include <utility>

#include "server/core/status.h"

namespace drape::gl {

// Owns one OpenGL buffer. Move-only; every call with its context current. Offsets and sizes in
// bytes.
class Buffer {
 public:
  Buffer() = default;
  // Contents are undefined. RESOURCE_EXHAUSTED (DEVICE_MEMORY) if the device has no room.
  static Result<Buffer> Create(size_t size_bytes);
  ~Buffer();
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(size_bytes_, other.size_bytes_);
    return *this;
  }

  GLuint name() const { return name_; }
  size_t size_bytes() const { return size_bytes_; }

  void Upload(size_t offset_bytes, std::span<const std::byte> bytes);
  // Waits for the device. Shader writes need a barrier with GL_BUFFER_UPDATE_BARRIER_BIT before.
  void Download(size_t offset_bytes, std::span<std::byte> bytes) const;
  // On the device.
  void CopyFrom(const Buffer& source, size_t size_bytes) { CopyFrom(source, 0, 0, size_bytes); }
  void CopyFrom(const Buffer& source, size_t source_offset_bytes, size_t offset_bytes,
                size_t size_bytes);
  void BindStorage(GLuint binding) const;
  void BindUniforms(GLuint binding) const;

 private:
  GLuint name_ = 0;
  size_t size_bytes_ = 0;
};

}  // namespace drape::gl
