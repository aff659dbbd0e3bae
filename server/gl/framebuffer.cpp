#include "server/gl/framebuffer.h"

#include <algorithm>
#include <string>

namespace drape::gl {

namespace {

constexpr GLint kSamples = 4;

GLint GlInt(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

Status NoRoom(const std::string& what) {
  return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY", what);
}

std::string SizeText(uint32_t width_px, uint32_t height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px) + " pixels";
}

void ForgetErrors() {
  while (glGetError() != GL_NO_ERROR) {
  }
}

}  // namespace

Result<PictureTarget> PictureTarget::Create(uint32_t width_px, uint32_t height_px) {
  DRAPE_CHECK(width_px > 0 && height_px > 0, "a picture needs a size");
  const auto largest = static_cast<uint32_t>(
      std::min(GlInt(GL_MAX_RENDERBUFFER_SIZE), GlInt(GL_MAX_FRAMEBUFFER_WIDTH)));
  if (std::max(width_px, height_px) > largest) {
    return NoRoom("the device draws pictures of at most " + SizeText(largest, largest) + ", not " +
                  SizeText(width_px, height_px));
  }
  ForgetErrors();
  PictureTarget target;
  target.width_px_ = width_px;
  target.height_px_ = height_px;
  const auto width = static_cast<GLsizei>(width_px);
  const auto height = static_cast<GLsizei>(height_px);
  const GLint samples = std::min(kSamples, GlInt(GL_MAX_SAMPLES));
  glCreateFramebuffers(2, target.framebuffers_.data());
  glCreateRenderbuffers(4, target.renderbuffers_.data());
  const auto [colour, depth, resolved, resolved_depth] = target.renderbuffers_;
  glNamedRenderbufferStorageMultisample(colour, samples, GL_SRGB8_ALPHA8, width, height);
  glNamedRenderbufferStorageMultisample(depth, samples, GL_DEPTH_COMPONENT32F, width, height);
  glNamedRenderbufferStorage(resolved, GL_SRGB8_ALPHA8, width, height);
  glNamedRenderbufferStorage(resolved_depth, GL_DEPTH_COMPONENT32F, width, height);
  const auto [many, one] = target.framebuffers_;
  glNamedFramebufferRenderbuffer(many, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour);
  glNamedFramebufferRenderbuffer(many, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
  glNamedFramebufferRenderbuffer(one, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, resolved);
  glNamedFramebufferRenderbuffer(one, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, resolved_depth);
  if (glGetError() != GL_NO_ERROR || !target.IsComplete()) {
    return NoRoom("the device has no room for a picture of " + SizeText(width_px, height_px));
  }
  return target;
}

bool PictureTarget::IsComplete() const {
  return std::all_of(framebuffers_.begin(), framebuffers_.end(), [](GLuint framebuffer) {
    return glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  });
}

PictureTarget::~PictureTarget() {
  // OpenGL ignores names that are 0.
  if (width_px_ == 0) return;
  glDeleteFramebuffers(2, framebuffers_.data());
  glDeleteRenderbuffers(4, renderbuffers_.data());
}

PictureTarget& PictureTarget::operator=(PictureTarget&& other) noexcept {
  std::swap(width_px_, other.width_px_);
  std::swap(height_px_, other.height_px_);
  std::swap(framebuffers_, other.framebuffers_);
  std::swap(renderbuffers_, other.renderbuffers_);
  return *this;
}

void PictureTarget::Begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[0]);
  glViewport(0, 0, static_cast<GLsizei>(width_px_), static_cast<GLsizei>(height_px_));
  glEnable(GL_FRAMEBUFFER_SRGB);
}

void PictureTarget::Resolve() const {
  Copy(GL_COLOR_BUFFER_BIT);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[1]);
}

void PictureTarget::ResolveDepths() const {
  Copy(GL_DEPTH_BUFFER_BIT);
}

void PictureTarget::Copy(GLbitfield what) const {
  const auto width = static_cast<GLint>(width_px_);
  const auto height = static_cast<GLint>(height_px_);
  glBlitNamedFramebuffer(framebuffers_[0], framebuffers_[1], 0, 0, width, height, 0, 0, width,
                         height, what, GL_NEAREST);
}

template <class T>
std::vector<T> PictureTarget::ReadPixels(GLenum format, GLenum type, size_t channels) const {
  const size_t row_size = channels * width_px_;
  std::vector<T> pixels(row_size * height_px_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers_[1]);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadnPixels(0, 0, static_cast<GLsizei>(width_px_), static_cast<GLsizei>(height_px_), format,
                type, static_cast<GLsizei>(pixels.size() * sizeof(T)), pixels.data());
  // OpenGL's first row is the bottom one.
  for (size_t row = 0; row < height_px_ / 2; ++row) {
    const auto top = pixels.begin() + static_cast<ptrdiff_t>(row * row_size);
    const auto bottom = pixels.end() - static_cast<ptrdiff_t>((row + 1) * row_size);
    std::swap_ranges(top, top + static_cast<ptrdiff_t>(row_size), bottom);
  }
  return pixels;
}

std::vector<uint8_t> PictureTarget::Read() const {
  return ReadPixels<uint8_t>(GL_RGB, GL_UNSIGNED_BYTE, 3);
}

std::vector<float> PictureTarget::ReadDepths() const {
  return ReadPixels<float>(GL_DEPTH_COMPONENT, GL_FLOAT, 1);
}

Result<DepthMap> DepthMap::Create(uint32_t size_px) {
  ForgetErrors();
  DepthMap map;
  map.size_px_ = size_px;
  const auto size = static_cast<GLsizei>(size_px);
  glCreateTextures(GL_TEXTURE_2D, 1, &map.texture_);
  glTextureStorage2D(map.texture_, 1, GL_DEPTH_COMPONENT32F, size, size);
  glTextureParameteri(map.texture_, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(map.texture_, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(map.texture_, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTextureParameteri(map.texture_, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glTextureParameteri(map.texture_, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTextureParameteri(map.texture_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const std::array<GLfloat, 4> farthest = {1, 1, 1, 1};
  glTextureParameterfv(map.texture_, GL_TEXTURE_BORDER_COLOR, farthest.data());
  glCreateFramebuffers(1, &map.framebuffer_);
  glNamedFramebufferTexture(map.framebuffer_, GL_DEPTH_ATTACHMENT, map.texture_, 0);
  glNamedFramebufferDrawBuffer(map.framebuffer_, GL_NONE);
  if (glGetError() != GL_NO_ERROR ||
      glCheckNamedFramebufferStatus(map.framebuffer_, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    return NoRoom("the device has no room for a shadow map of " + SizeText(size_px, size_px));
  }
  return map;
}

DepthMap::~DepthMap() {
  if (size_px_ == 0) return;
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteTextures(1, &texture_);
}

DepthMap& DepthMap::operator=(DepthMap&& other) noexcept {
  std::swap(size_px_, other.size_px_);
  std::swap(framebuffer_, other.framebuffer_);
  std::swap(texture_, other.texture_);
  return *this;
}

void DepthMap::Begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, static_cast<GLsizei>(size_px_), static_cast<GLsizei>(size_px_));
}

}  // namespace drape::gl
