#include "server/solver/cpu/formulas/distance_map_gap.h"

#include <algorithm>
#include <utility>

namespace drape::cpu {
namespace {

// Length of a gradient [-] below which its direction is rounding, as in DistanceMap.
constexpr float kMinGradient = static_cast<float>(DistanceMap::kMinGradient);

float Between(float a, float b, float t) {
  return a + t * (b - a);
}

// The four values at the corners of a square, bit 0 of the index: the first direction.
float Bilinear(const std::array<float, 4>& values, float s, float t) {
  return Between(Between(values[0], values[1], s), Between(values[2], values[3], s), t);
}

}  // namespace

DistanceSamples::DistanceSamples(std::shared_ptr<const DistanceMap> its_map)
    : map(std::move(its_map)),
      values(map->samples_m().data()),
      counts(map->sample_counts()),
      cell(static_cast<float>(map->cell_m())),
      inverse_cell(static_cast<float>(1 / map->cell_m())) {}

Gap DistanceMapGap(Vec4 q, Vec4 corner, const std::array<Vec4, 3>& axes,
                   const DistanceSamples& samples, float offset) {
  const Vec4 d = q - corner;
  std::array<uint32_t, 3> cell;
  float fraction[3], outside[3];
  for (uint32_t k = 0; k < 3; ++k) {
    const float in_cells = Dot(d, axes[k]) * samples.inverse_cell;
    // In this order not a number becomes 0, and the index stays legal.
    const float clamped =
        std::min(std::max(0.0f, in_cells), static_cast<float>(samples.counts[k] - 1));
    cell[k] = std::min(static_cast<uint32_t>(clamped), samples.counts[k] - 2);
    fraction[k] = clamped - static_cast<float>(cell[k]);
    outside[k] = (in_cells - clamped) * samples.cell;
  }
  const size_t row = samples.counts[0];
  const size_t layer = row * samples.counts[1];
  const float* const first = samples.values + cell[2] * layer + cell[1] * row + cell[0];
  const float* const second = first + layer;
  // Bit 0 of the index: +x, bit 1: +y, bit 2: +z.
  const std::array<float, 8> s = {first[0],  first[1],  first[row],  first[row + 1],
                                  second[0], second[1], second[row], second[row + 1]};
  const float inside =
      Between(Bilinear({s[0], s[1], s[2], s[3]}, fraction[0], fraction[1]),
              Bilinear({s[4], s[5], s[6], s[7]}, fraction[0], fraction[1]), fraction[2]);
  float gradient[3] = {
      Bilinear({s[1] - s[0], s[3] - s[2], s[5] - s[4], s[7] - s[6]}, fraction[1], fraction[2]),
      Bilinear({s[2] - s[0], s[3] - s[1], s[6] - s[4], s[7] - s[5]}, fraction[0], fraction[2]),
      Bilinear({s[4] - s[0], s[5] - s[1], s[6] - s[2], s[7] - s[3]}, fraction[0], fraction[1])};
  for (float& component : gradient) component *= samples.inverse_cell;
  float distance = inside;
  const float outside_sq =
      outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2];
  if (outside_sq != 0) {
    // The box's nearest point moves with q only along the axes on which q is within.
    distance = std::sqrt(inside * inside + outside_sq);
    for (uint32_t k = 0; k < 3; ++k) {
      gradient[k] = (outside[k] == 0 ? inside * gradient[k] : outside[k]) / distance;
    }
  }
  const float length =
      std::sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2]);
  if (length < kMinGradient) return {distance - offset, axes[1]};
  Vec4 normal{};
  for (uint32_t k = 0; k < 3; ++k) normal += gradient[k] / length * axes[k];
  return {distance - offset, normal};
}

}  // namespace drape::cpu
