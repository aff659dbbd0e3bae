#include "server/render/gl_draw/palette.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace drape::render {

namespace {

double LinearFromSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

// Hue, saturation and value, each 0..1, in sRGB.
shader::vec4 LinearFromHsv(double hue, double saturation, double value) {
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + 6 * hue, 6.0);
    const double distance = std::min({k, 4 - k, 1.0});
    return static_cast<float>(LinearFromSrgb(value - value * saturation * std::max(distance, 0.0)));
  };
  return {channel(5), channel(3), channel(1), 1};
}

}  // namespace

shader::vec4 LinearFromHex(uint32_t srgb) {
  const auto channel = [srgb](int shift) {
    return static_cast<float>(LinearFromSrgb(static_cast<double>((srgb >> shift) & 0xff) / 255));
  };
  return {channel(16), channel(8), channel(0), 1};
}

shader::vec4 ClothColour(uint32_t cloth_index) {
  constexpr std::array<uint32_t, 8> kColours = {0x2a9d8f, 0xe07a5f, 0x4a6fa5, 0xe9b44c,
                                                0x8e5572, 0x7fae5f, 0x5b9fb0, 0xcf6a78};
  return LinearFromHex(kColours[cloth_index % kColours.size()]);
}

shader::vec4 GroupColour(uint32_t group) {
  // M. Petroff's ten colours for figures in their order (arXiv:2107.02270), with the greys
  // replaced.
  constexpr std::array<uint32_t, 10> kColours = {0x3f90da, 0xe76300, 0x2e9f4d, 0xbd1f01, 0x832db6,
                                                 0xf2b632, 0xe377c2, 0x17becf, 0x8a5a3c, 0x6b7a1e};
  if (group < kColours.size()) return LinearFromHex(kColours[group]);
  // Steps of the golden ratio never come near a recent hue.
  constexpr double kGoldenRatio = 0.6180339887498949;
  const double turns = kGoldenRatio * group;
  constexpr std::array<double, 3> kValues = {0.9, 0.6, 0.75};
  return LinearFromHsv(turns - std::floor(turns), 0.75, kValues[group % kValues.size()]);
}

}  // namespace drape::render
