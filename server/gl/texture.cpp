#include "server/gl/texture.h"

namespace drape::gl {

Result<GreyTexture> GreyTexture::Create(uint32_t width, uint32_t height,
                                        std::span<const uint8_t> texels) {
  DRAPE_CHECK(texels.size() == size_t{width} * height, "a texture needs one byte per texel");
  while (glGetError() != GL_NO_ERROR) {
  }
  GreyTexture texture;
  glCreateTextures(GL_TEXTURE_2D, 1, &texture.name_);
  glTextureStorage2D(texture.name_, 1, GL_R8, static_cast<GLsizei>(width),
                     static_cast<GLsizei>(height));
  glTextureParameteri(texture.name_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(texture.name_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(texture.name_, 0, 0, 0, static_cast<GLsizei>(width),
                      static_cast<GLsizei>(height), GL_RED, GL_UNSIGNED_BYTE, texels.data());
  if (glGetError() != GL_NO_ERROR) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device has no room for a texture");
  }
  return texture;
}

GreyTexture::~GreyTexture() {
  if (name_ != 0) glDeleteTextures(1, &name_);
}

}  // namespace drape::gl
