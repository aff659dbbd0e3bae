#include "server/gl/staging.h"

#include <algorithm>
#include <cstring>

namespace drape::gl {

void Staging::Forget() {
  name_ = 0;
  for (Fence& fence : are_copied_) fence.Forget();
}

bool Staging::Map() {
  if (name_ != 0 || is_refused_) return name_ != 0;
  constexpr GLbitfield kMapping = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  constexpr auto kBytes = static_cast<GLsizeiptr>(kSegments * kSegmentBytes);
  glCreateBuffers(1, &name_);
  glNamedBufferStorage(name_, kBytes, nullptr, kMapping | GL_CLIENT_STORAGE_BIT);
  bytes_ = static_cast<std::byte*>(glMapNamedBufferRange(name_, 0, kBytes, kMapping));
  if (bytes_ != nullptr) return true;
  glDeleteBuffers(1, &name_);
  name_ = 0;
  is_refused_ = true;
  return false;
}

void Staging::CopyTo(GLuint buffer, size_t offset_bytes, std::span<const std::byte> bytes) {
  if (!Map()) {
    WaitForDevice();
    glNamedBufferSubData(buffer, static_cast<GLintptr>(offset_bytes),
                         static_cast<GLsizeiptr>(bytes.size()), bytes.data());
    return;
  }
  while (!bytes.empty()) {
    if (used_bytes_ == kSegmentBytes) {
      are_copied_[segment_] = Fence::Insert();
      segment_ = (segment_ + 1) % kSegments;
      used_bytes_ = 0;
      are_copied_[segment_].Wait();
    }
    const size_t count = std::min(bytes.size(), kSegmentBytes - used_bytes_);
    const size_t begin = segment_ * kSegmentBytes + used_bytes_;
    std::memcpy(bytes_ + begin, bytes.data(), count);
    glCopyNamedBufferSubData(name_, buffer, static_cast<GLintptr>(begin),
                             static_cast<GLintptr>(offset_bytes), static_cast<GLsizeiptr>(count));
    used_bytes_ += count;
    offset_bytes += count;
    bytes = bytes.subspan(count);
  }
}

}  // namespace drape::gl
