// Random clients of several tenants, through a proxy that cuts connections, of a server that is
// killed and starts again.
#pragma once

#include <cstdint>

#include "tests/traffic/history.h"

namespace drape::test {

struct TrafficOptions {
  uint32_t seed = 1;
  uint64_t operations = 2000;  // acknowledged, of all workers; ends then
  // Mean number of them between two ends of the server; every third end is a drain. 0: none.
  uint64_t operations_per_run = 200;
  double checkpoint_interval_s = 0.2;
  // Faults to be found.
  bool forgets_request_ids = false;
  bool takes_own_sessions_for_foreign = false;
};

// How many of them; the last three of a tenant's share one session and one of its cloths.
inline constexpr uint32_t kWorkers = 8;

// Minutes, if the operations are many. Failures of the machinery itself are failures of the test.
TrafficHistory RunTraffic(const TrafficOptions& options);

}  // namespace drape::test
