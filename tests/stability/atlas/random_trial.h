// Random cloths, stepped together and judged by the energy that they gain.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/solver/backend.h"
#include "server/solver/step_settings.h"
#include "tests/support/random_cloths.h"

namespace drape::test {

// The most that a cloth may ever gain, of its scale (EnergyScale_j): the bar.
inline constexpr double kMaxRandomGain = 0.01;

struct RandomTrial {
  std::string name;  // kind, form and seed
  uint64_t seed = 0;
  double largest_gain = 0;  // of its scale, at the end of any step
  FaultReason fault = FaultReason::kNone;
  bool is_finite = true;    // every state that was read
  bool has_warned = false;  // of energy that it gained, in any step
};

// The cloths of one kind with `count` seeds from `first_seed` on, as the server steps them
// (substeps raised with the load, no sleep), for that long.
std::vector<RandomTrial> TryRandomCloths(Backend& backend, RandomKind kind,
                                         const StepSettings& settings, uint64_t first_seed,
                                         uint64_t count, double duration_s);

}  // namespace drape::test
