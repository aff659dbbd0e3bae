#include "server/render/png.h"

#include <png.h>

namespace drape::render {

Result<std::string> EncodePng(const Picture& picture) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.width_px;
  image.height = picture.height_px;
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;  // half the time for a few per cent more bytes
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string file(size, '\0');
  const bool is_written =
      png_image_write_to_memory(&image, file.data(), &size, /*convert=*/0, picture.rgb.data(),
                                /*row_stride=*/0, nullptr) != 0;
  if (!is_written) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  std::string("the PNG file was not written: ") + image.message);
  }
  file.resize(size);
  return file;
}

}  // namespace drape::render
