// Plays a scene with many contestants in turn, so that a disturbance of the machine affects all of
// them, and measures time and deviations.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tests/bench/accuracy/contestant.h"
#include "tests/bench/accuracy/deviations.h"

namespace drape::bench {

struct PlayLimits {
  uint32_t repeats = 4;  // timed plays at most, after a first one that warms up and is observed
  double seconds = 0.8;  // no further play of a contestant that has taken this long
  double play_s = 20;    // a contestant that is going to take longer for a play is stopped
};

struct PlayResult {
  // "ok"; "faulted": the cloth blew up; "over_time": stopped because of PlayLimits::play_s. The
  // deviations are defined for "ok" only.
  std::string status = "ok";
  Deviations deviations;
  uint32_t repeats = 0;  // plays that the times come from
  // Wall ms of a simulated second: the median, the least and the most of the repeats.
  double wall_ms_per_s = 0;
  double wall_min_ms_per_s = 0;
  double wall_max_ms_per_s = 0;
  double iterations_per_frame = 0;  // sweeps
};

// One result per entry. In each round every contestant plays the scene once, a tenth of it at a
// time; the first round counts for the time only if there is no other.
std::vector<PlayResult> PlaySideBySide(std::span<Entry> entries, const AccuracyScene& scene,
                                       const std::vector<Eigen::Vector3d>& reference_m,
                                       const PlayLimits& limits);

}  // namespace drape::bench
