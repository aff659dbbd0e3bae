#include "server/gl/framebuffer.h"

#include <algorithm>
#include <string>

namespace drape::gl {

namespace {

constexpr uint32_t kManySamples = 4;

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

Result<PictureTarget> PictureTarget::Create(uint32_t width_px, uint32_t height_px,
                                            uint32_t samples) {
  DRAPE_CHECK(width_px > 0 && height_px > 0, "a picture needs a size");
  DRAPE_CHECK(samples == 1 || samples == kManySamples, "one or four samples per pixel");
  const auto largest =
      static_cast<uint32_t>(std::min(GlInt(GL_MAX_TEXTURE_SIZE), GlInt(GL_MAX_FRAMEBUFFER_WIDTH)));
  if (std::max(width_px, height_px) > largest) {
    return NoRoom("the device draws pictures of at most " + SizeText(largest, largest) + ", not " +
                  SizeText(width_px, height_px));
  }
  ForgetErrors();
  PictureTarget target;
  target.width_px_ = width_px;
  target.height_px_ = height_px;
  target.row_count_ = height_px;
  target.samples_ = samples;
  target.MakeTextures();
  if (glGetError() != GL_NO_ERROR || !target.IsComplete()) {
    return NoRoom("the device has no room for a picture of " + SizeText(width_px, height_px));
  }
  return target;
}

void PictureTarget::MakeTextures() {
  const auto width = static_cast<GLsizei>(width_px_);
  const auto height = static_cast<GLsizei>(height_px_);
  const bool is_many = samples_ > 1;
  const GLenum kind = is_many ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
  const auto store = [&](GLuint texture, GLenum format) {
    if (is_many) {
      glTextureStorage2DMultisample(texture, static_cast<GLsizei>(samples_), format, width, height,
                                    GL_TRUE);
    } else {
      glTextureStorage2D(texture, 1, format, width, height);
    }
  };
  glCreateTextures(kind, 2, &textures_[kColour]);
  store(textures_[kColour], GL_SRGB8_ALPHA8);
  store(textures_[kDepth], GL_DEPTH_COMPONENT32F);
  glGenTextures(1, &textures_[kStoredColour]);
  glTextureView(textures_[kStoredColour], kind, textures_[kColour], GL_RGBA8, 0, 1, 0, 1);
  glCreateTextures(GL_TEXTURE_2D, 2, &textures_[kPackedColour]);
  glTextureStorage2D(textures_[kPackedColour], 1, GL_RGBA8, width, height);
  glTextureStorage2D(textures_[kPackedNumber], 1, GL_R32F, width, height);

  glCreateFramebuffers(2, framebuffers_.data());
  const auto [many, packed] = framebuffers_;
  glNamedFramebufferTexture(many, GL_COLOR_ATTACHMENT0, textures_[kColour], 0);
  glNamedFramebufferTexture(many, GL_DEPTH_ATTACHMENT, textures_[kDepth], 0);
  glNamedFramebufferTexture(packed, GL_COLOR_ATTACHMENT0, textures_[kPackedColour], 0);
  glNamedFramebufferTexture(packed, GL_COLOR_ATTACHMENT1, textures_[kPackedNumber], 0);
  const std::array<GLenum, 2> outputs = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(packed, 2, outputs.data());
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
  glDeleteTextures(kTextureCount, textures_.data());
}

PictureTarget& PictureTarget::operator=(PictureTarget&& other) noexcept {
  std::swap(width_px_, other.width_px_);
  std::swap(height_px_, other.height_px_);
  std::swap(row_count_, other.row_count_);
  std::swap(samples_, other.samples_);
  std::swap(framebuffers_, other.framebuffers_);
  std::swap(textures_, other.textures_);
  return *this;
}

void PictureTarget::UseRows(uint32_t row_count) {
  DRAPE_CHECK(row_count <= height_px_, "a picture has the rows that it was made with");
  row_count_ = row_count;
}

void PictureTarget::Begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[0]);
  glViewport(0, 0, static_cast<GLsizei>(width_px_), static_cast<GLsizei>(row_count_));
}

void PictureTarget::BeginPacking(GLuint colour_unit, GLuint depth_unit) const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[1]);
  glBindTextureUnit(colour_unit, textures_[kStoredColour]);
  glBindTextureUnit(depth_unit, textures_[kDepth]);
}

template <class T>
std::vector<T> PictureTarget::ReadPixels(GLenum attachment, GLenum format, GLenum type,
                                         size_t channels) const {
  std::vector<T> pixels(channels * width_px_ * row_count_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers_[1]);
  glReadBuffer(attachment);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadnPixels(0, 0, static_cast<GLsizei>(width_px_), static_cast<GLsizei>(row_count_), format,
                type, static_cast<GLsizei>(pixels.size() * sizeof(T)), pixels.data());
  return pixels;
}

std::vector<uint8_t> PictureTarget::ReadColours() const {
  return ReadPixels<uint8_t>(GL_COLOR_ATTACHMENT0, GL_RGB, GL_UNSIGNED_BYTE, 3);
}

std::vector<float> PictureTarget::ReadNumbers() const {
  return ReadPixels<float>(GL_COLOR_ATTACHMENT1, GL_RED, GL_FLOAT, 1);
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
