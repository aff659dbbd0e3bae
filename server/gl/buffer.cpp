#include "server/gl/buffer.h"

#include <limits>
#include <string>

#include "server/gl/context.h"

namespace drape::gl {

Result<Buffer> Buffer::Create(size_t size_bytes, GLbitfield flags) {
  DRAPE_CHECK(size_bytes > 0 && size_bytes <= std::numeric_limits<GLsizeiptr>::max(),
              "a buffer needs a size");
  while (glGetError() != GL_NO_ERROR) {
  }
  Buffer buffer;
  glCreateBuffers(1, &buffer.name_);
  glNamedBufferStorage(buffer.name_, static_cast<GLsizeiptr>(size_bytes), nullptr, flags);
  buffer.size_bytes_ = size_bytes;
  if (glGetError() != GL_NO_ERROR) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device has no room for " + std::to_string(size_bytes) + " more bytes");
  }
  return buffer;
}

Result<ReadbackBuffer> ReadbackBuffer::Create(size_t size_bytes) {
  constexpr GLbitfield kMapping = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  DRAPE_ASSIGN_OR_RETURN(Buffer buffer,
                         Buffer::Create(size_bytes, kMapping | GL_CLIENT_STORAGE_BIT));
  ReadbackBuffer readback;
  readback.buffer_ = std::move(buffer);
  readback.bytes_ = static_cast<const std::byte*>(glMapNamedBufferRange(
      readback.buffer_.name(), 0, static_cast<GLsizeiptr>(size_bytes), kMapping));
  if (readback.bytes_ == nullptr) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the driver cannot map " + std::to_string(size_bytes) + " bytes");
  }
  return readback;
}

Buffer::~Buffer() {
  if (name_ != 0) glDeleteBuffers(1, &name_);
}

void Buffer::Upload(size_t offset_bytes, std::span<const std::byte> bytes) {
  DRAPE_CHECK(offset_bytes + bytes.size() <= size_bytes_, "upload beyond the end of a buffer");
  if (bytes.empty()) return;
  Context::Current().staging().CopyTo(name_, offset_bytes, bytes);
}

void Buffer::Clear(size_t offset_bytes, size_t size_bytes) {
  DRAPE_CHECK(offset_bytes + size_bytes <= size_bytes_, "clearing beyond the end of a buffer");
  if (size_bytes == 0) return;
  glClearNamedBufferSubData(name_, GL_R32UI, static_cast<GLintptr>(offset_bytes),
                            static_cast<GLsizeiptr>(size_bytes), GL_RED_INTEGER, GL_UNSIGNED_INT,
                            nullptr);
}

void Buffer::Download(size_t offset_bytes, std::span<std::byte> bytes) const {
  DRAPE_CHECK(offset_bytes + bytes.size() <= size_bytes_, "download beyond the end of a buffer");
  if (bytes.empty()) return;
  glGetNamedBufferSubData(name_, static_cast<GLintptr>(offset_bytes),
                          static_cast<GLsizeiptr>(bytes.size()), bytes.data());
}

void Buffer::CopyFrom(const Buffer& source, size_t source_offset_bytes, size_t offset_bytes,
                      size_t size_bytes) {
  DRAPE_CHECK(offset_bytes + size_bytes <= size_bytes_ &&
                  source_offset_bytes + size_bytes <= source.size_bytes_,
              "copy beyond the end");
  if (size_bytes == 0) return;
  glCopyNamedBufferSubData(source.name_, name_, static_cast<GLintptr>(source_offset_bytes),
                           static_cast<GLintptr>(offset_bytes),
                           static_cast<GLsizeiptr>(size_bytes));
}

void Buffer::BindStorage(GLuint binding) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name_);
}

void Buffer::BindUniforms(GLuint binding) const {
  glBindBufferBase(GL_UNIFORM_BUFFER, binding, name_);
}

void Buffer::BindUniforms(GLuint binding, size_t offset_bytes, size_t size_bytes) const {
  DRAPE_CHECK(offset_bytes + size_bytes <= size_bytes_, "uniforms beyond the end of a buffer");
  glBindBufferRange(GL_UNIFORM_BUFFER, binding, name_, static_cast<GLintptr>(offset_bytes),
                    static_cast<GLsizeiptr>(size_bytes));
}

}  // namespace drape::gl
