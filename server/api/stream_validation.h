// From the first message of a stream to plain values, or INVALID_ARGUMENT with every violation.
// Pure.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "drape/v1/run.pb.h"
#include "drape/v1/simulation_service.pb.h"
#include "server/api/view_validation.h"
#include "server/core/ids.h"
#include "server/core/status.h"

namespace drape::api {

// A checked Subscribe.
struct CheckedSubscription {
  std::vector<ClothId> cloths;
  ViewSpec view;
  uint32_t every_n_steps = 1;
  double max_hz = 0;
  uint32_t initial_credit = 0;
  // With EVERY_FRAME.
  struct Queue {
    uint32_t max_frames = 256;
    uint64_t max_bytes = uint64_t{16} << 20;
  };
  std::optional<Queue> queue;
};
Result<CheckedSubscription> CheckSubscribe(const v1::StreamStatesRequest::Subscribe& request);

// A checked Start of a Run.
struct CheckedRun {
  std::vector<ClothId> cloths;
  bool is_real_time = false;  // the interval is the time step of the cloths
  double interval_s = 0;      // of wall time between two steps; 0: unpaced
  uint64_t max_steps = std::numeric_limits<uint64_t>::max();
  double max_behind_s = 0.1;
  double report_interval_s = 1;
  std::optional<uint64_t> expected_step;
};
Result<CheckedRun> CheckRun(const v1::RunRequest::Start& request);

}  // namespace drape::api
