// Wall time of a step, the backends side by side.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/solver/backend.h"
#include "tests/support/scenes.h"

namespace drape::bench {

struct NamedBackend {
  std::string name;
  std::unique_ptr<Backend> backend;
};

// Cloths that are stepped together: the same model and state, each under its own gravity.
struct ClothBatch {
  test::Scene scene;
  std::vector<Eigen::Vector3d> gravities_m_per_s2;  // one per cloth
};

// `count` cloths, their gravities spread evenly over a cone of 10 degrees around -y, so that no two
// cloths are equal. count = 1: a tilt of 7 degrees.
ClothBatch MakeBatch(test::Scene scene, uint32_t count);

struct TimingLimits {
  uint32_t warm_up = 2;    // steps that do not count
  uint32_t steps = 30;     // timed steps at most
  uint32_t min_steps = 3;  // timed steps at least, whatever they take
  double seconds = 1;      // no further steps of a backend whose timed ones have taken this long
};

// Steps on a GPU for half a second, so that it leaves the low clocks of idleness; elsewhere
// nothing.
void RaiseClocks(Backend& backend, std::span<const StepItem> items);

struct StepTimes {
  uint32_t steps = 0;    // timed
  double median_ms = 0;  // wall time of Backend::Step for the whole batch
  double p10_ms = 0;
  double p90_ms = 0;
  double min_ms = 0;
  double max_ms = 0;
  double device_ms = 0;          // median of what the backend reports
  uint32_t dispatches = 0;       // of the last step
  double iterations = 0;         // sweeps in a step: mean over cloths and timed steps
  double max_strain = 0;         // over the cloths, one step after the last timed one
  double rms_strain = 0;         // largest of a cloth, at the same time
  uint32_t contacts = 0;         // sum over all cloths, at the same time
  uint32_t faulted = 0;          // cloths that have blown up; the times then mean nothing
  double solves_per_second = 0;  // cloths * constraints * iterations / median
};

// One step of each backend in turn, until each has its steps, so that a disturbance of the machine
// affects all of them. One StepTimes per backend.
std::vector<StepTimes> TimeSideBySide(std::span<NamedBackend> backends, const ClothBatch& batch,
                                      const TimingLimits& limits);

// The scene after `steps` steps on a backend, and the largest strain on the way.
struct PreparedScene {
  test::Scene scene;
  double max_strain = 0;
};
PreparedScene Advance(Backend& backend, test::Scene scene, uint32_t steps);

}  // namespace drape::bench
