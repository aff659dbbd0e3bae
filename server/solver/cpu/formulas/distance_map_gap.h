// Distance and normal of a solid by the samples of its distance map, in single precision.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "server/scene/distance_map.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {

// The part of a map that a distance needs. The samples are the map's own, which are floats already.
struct DistanceSamples {
  DistanceSamples() = default;
  explicit DistanceSamples(std::shared_ptr<const DistanceMap> its_map);

  std::shared_ptr<const DistanceMap> map;  // keeps the samples
  const float* values = nullptr;           // [count z][count y][count x] [m]
  std::array<uint32_t, 3> counts{};        // each >= 2
  float cell = 0;                          // [m]
  float inverse_cell = 0;                  // [1/m]
};

// As DistanceMap::SurfaceAt: the trilinear interpolation and its gradient; outside the grid the
// root of the squares of the way to its box and of the distance there. `corner`: the place of the
// first sample, `axes`: the directions of the grid, `offset` = thickness. Coordinates are counted
// from the corner, in cells, so that their rounding is that of the size of the grid, wherever the
// mesh lies in its own frame.
Gap DistanceMapGap(Vec4 q, Vec4 corner, const std::array<Vec4, 3>& axes,
                   const DistanceSamples& samples, float offset);

}  // namespace drape::cpu
