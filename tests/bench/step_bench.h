// Time of one step against the number and the size of cloths, straight on a backend (no server).
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "server/solver/backend.h"

namespace drape::bench {

struct StepCase {
  uint32_t cloths = 1;
  uint32_t side = 32;  // particles = side * side
  StepSettings settings;
};

struct StepTimes {
  double median_ms = 0;  // wall time of Backend::Step for the whole batch
  double min_ms = 0;
  double max_ms = 0;
  double device_ms = 0;          // median of what the backend reports
  uint32_t dispatches = 0;       // of one batch
  uint32_t iterations = 0;       // sweeps of the first cloth in the last step
  double max_strain = 0;         // over all cloths, after the last step
  double solves_per_second = 0;  // constraints * sweeps / median
};

// `cloths` square sheets of 1 m and 0.2 kg, two corners pinned, released horizontally, each with
// its own gravity direction within 10 degrees, so that no two are equal. `warm_up` steps, then
// `steps` timed ones.
StepTimes MeasureSteps(Backend& backend, const StepCase& step_case, uint32_t warm_up,
                       uint32_t steps);

}  // namespace drape::bench
