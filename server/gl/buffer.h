// Device memory.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <span>
#include <utility>

#include "server/core/status.h"

namespace drape::gl {

// Owns one OpenGL buffer. Move-only; its context must be current in every call. Offsets and sizes
// in bytes.
class Buffer {
 public:
  Buffer() = default;
  // Contents are undefined. RESOURCE_EXHAUSTED (DEVICE_MEMORY) if the device has no room.
  static Result<Buffer> Create(size_t size_bytes) {
    return Create(size_bytes, GL_DYNAMIC_STORAGE_BIT);
  }
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
  // To zeros. As Upload, it comes after what has been sent to the device before.
  void Clear(size_t offset_bytes, size_t size_bytes);
  // Waits for the device. After shader writes, call glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT)
  // first.
  void Download(size_t offset_bytes, std::span<std::byte> bytes) const;
  // On the device.
  void CopyFrom(const Buffer& source, size_t size_bytes) { CopyFrom(source, 0, 0, size_bytes); }
  void CopyFrom(const Buffer& source, size_t source_offset_bytes, size_t offset_bytes,
                size_t size_bytes);
  void BindStorage(GLuint binding) const;
  void BindUniforms(GLuint binding) const;
  // A part, from a multiple of 256 bytes on.
  void BindUniforms(GLuint binding, size_t offset_bytes, size_t size_bytes) const;

 private:
  friend class ReadbackBuffer;
  static Result<Buffer> Create(size_t size_bytes, GLbitfield flags);

  GLuint name_ = 0;
  size_t size_bytes_ = 0;
};

// Host memory that the device copies into. It stays mapped, and the host reads it in place.
// Move-only; as Buffer.
class ReadbackBuffer {
 public:
  // Contents are undefined. RESOURCE_EXHAUSTED (DEVICE_MEMORY) if there is no room.
  static Result<ReadbackBuffer> Create(size_t size_bytes);

  size_t size_bytes() const { return buffer_.size_bytes(); }
  // On the device.
  void CopyFrom(const Buffer& source, size_t source_offset_bytes, size_t offset_bytes,
                size_t size_bytes) {
    buffer_.CopyFrom(source, source_offset_bytes, offset_bytes, size_bytes);
  }
  // The bytes copied before a fence that the host has waited for. Any thread.
  const std::byte* bytes() const { return bytes_; }

 private:
  Buffer buffer_;
  const std::byte* bytes_ = nullptr;
};

}  // namespace drape::gl
