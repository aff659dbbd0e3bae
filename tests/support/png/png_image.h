// A PNG file as pixels.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace drape::test {

struct PngImage {
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  std::vector<uint8_t> rgb;  // [height_px][width_px][3], top row first

  std::array<int, 3> At(uint32_t x, uint32_t y) const;
};

// Throws std::runtime_error if `file` is not a whole PNG file of 8-bit RGB.
PngImage DecodePng(const std::string& file);

// The share of pixels of which some channel differs by more than `tolerance`, in [0, 1]; 1 where
// the sizes differ.
double DifferentShare(const PngImage& a, const PngImage& b, int tolerance = 8);

}  // namespace drape::test
