#include "tests/support/png/png_image.h"

#include <png.h>

#include <cstdlib>
#include <stdexcept>

namespace drape::test {

std::array<int, 3> PngImage::At(uint32_t x, uint32_t y) const {
  const size_t first = 3 * (size_t{y} * width_px + x);
  return {rgb.at(first), rgb.at(first + 1), rgb.at(first + 2)};
}

PngImage DecodePng(const std::string& file) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, file.data(), file.size()) == 0) {
    throw std::runtime_error(std::string("not a PNG file: ") + header.message);
  }
  if (header.format != PNG_FORMAT_RGB) {
    png_image_free(&header);
    throw std::runtime_error("not 8-bit RGB");
  }
  PngImage image;
  image.width_px = header.width;
  image.height_px = header.height;
  image.rgb.resize(PNG_IMAGE_SIZE(header));
  if (png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("a broken PNG file: ") + header.message);
  }
  return image;
}

double DifferentShare(const PngImage& a, const PngImage& b, int tolerance) {
  if (a.width_px != b.width_px || a.height_px != b.height_px) return 1;
  size_t different = 0;
  for (size_t pixel = 0; pixel < a.rgb.size() / 3; ++pixel) {
    bool is_different = false;
    for (size_t k = 3 * pixel; k < 3 * pixel + 3; ++k) {
      is_different |= std::abs(a.rgb[k] - b.rgb[k]) > tolerance;
    }
    different += is_different;
  }
  return static_cast<double>(different) / static_cast<double>(a.rgb.size() / 3);
}

}  // namespace drape::test
