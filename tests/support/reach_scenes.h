// Sheets near colliders and far from them: leaving out colliders that a cloth cannot meet within a
// step must not change them.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/colliders.h"
#include "server/solver/step_settings.h"
#include "tests/support/scenes.h"

namespace drape::test {

struct ReachCase {
  Scene scene;
  uint32_t steps = 1;
  bool meets = false;    // the colliders change something
  bool repeats = false;  // particles get farther within a step than the estimate
  bool fits_lanes = true;
};
// The scene's name.
void PrintTo(const ReachCase& one, std::ostream* stream);

// Sheets of these numbers of particles, 1 m x 1 m: falling, hanging, bursting; with every kind of
// collider, moving ones too, under several presets.
std::vector<ReachCase> ReachCases(uint32_t columns, uint32_t rows);

// One of each kind, their tops at this height below the middle of a sheet.
std::vector<std::pair<std::string, Collider>> EachKind(double top_m);
// Those, and a cylinder, which ReachCases leave out: tests/golden has their states.
std::vector<std::pair<std::string, Collider>> EveryKind(double top_m);

// 1 m x 1 m, at rest in the plane y = 0, with friction and restitution.
Scene ReachSheet(const std::string& name, Preset preset, uint32_t columns, uint32_t rows,
                 std::vector<uint32_t> pins = {});

// Solid beyond this x.
Collider Wall(double x_m);

}  // namespace drape::test
