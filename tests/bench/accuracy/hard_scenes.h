// Variants to which nothing may be tuned: turned, cut on the bias, other pins, unequal masses, odd
// sizes, meshes, and loads for which impulse methods are weak.
#pragma once

#include "tests/bench/accuracy/accuracy_scenes.h"

namespace drape::bench {

// The sheets of two_corners_32 in other shapes, the skirt of the examples, a heavy hem: strain.
std::vector<AccuracyScene> HardScenes();

// A swinging sheet of 45 x 27 particles whose masses differ by a factor of 10, its plane turned by
// 30 degrees: positions.
AccuracyScene HardSwing();

// A rope of 64 links with a load of 1000 links at its end, let go at 1 rad: positions.
AccuracyScene Rope();

// A sheet in the xz plane hangs down from its first row, in the vertical plane that makes
// `turn_rad` with x, and moves out of that plane: at the hem 1 m/s at one side and 0.4 at the
// other.
void HangAndPush(test::Scene& sheet, double turn_rad);

// The reference of a scene without contacts, locked rows and compliance, by the direct solver.
void SetDirectReference(AccuracyScene& scene);

}  // namespace drape::bench
