// The scenes of the benchmarks. Plain values; nothing is random.
#pragma once

#include <cstdint>
#include <string>

#include "server/solver/step_settings.h"
#include "tests/support/scenes.h"

namespace drape::bench {

// The settings of a preset's name; the name must be one of PAPER, REALTIME, ACCURATE.
StepSettings SettingsOf(const std::string& preset);

// The held particles of a sheet; the paper does not state them for its scenes.
enum class Pins { kCorners, kEdge };  // the two corners of the first row, or the whole first row
std::string PinsName(Pins pins);      // "corners", "edge"

// The two sides of the grid of `particle_count` particles that is closest to a square.
struct GridSides {
  uint32_t columns = 0;  // >= rows
  uint32_t rows = 0;
};
GridSides SidesOf(uint32_t particle_count);

// A sheet 1 m wide with square cells, 0.2 kg/m^2, pinned, released horizontally.
test::Scene Sheet(uint32_t particle_count, Pins pins, const StepSettings& settings);

// Figure 4 of the paper: side x side particles (256 there), 2 m, two corners pinned; let go
// horizontally, the sheet swings down onto a sphere with friction. scenes/figure_4.json is the same
// for `drape run`; a test compares the two.
test::Scene Figure4(uint32_t side, const StepSettings& settings);

// A frustum of triangles, waist of 0.3 m radius pinned, 0.8 m long, let hang: no grid, six
// constraints meet in a particle. around x down particles.
test::Scene Skirt(uint32_t around, uint32_t down, const StepSettings& settings);

}  // namespace drape::bench
