// Building scene models on the builder threads, only while somebody waits for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "server/api/simulation_service.h"
#include "server/core/interruption.h"
#include "server/core/rate_quota.h"
#include "server/session/session.h"

namespace drape::api {

// Somebody who waits for a build.
struct Waiter {
  CancelToken cancel;
  int64_t deadline_us = std::numeric_limits<int64_t>::max();  // as Caller's
};

// The time that tenants take of the builder threads [s of one thread]. Thread-safe.
struct BuildQuota {
  // What an idle tenant may save up [s]: builds come in bursts, when cloths are made.
  static constexpr double kBucket_s = 60;

  explicit BuildQuota(const Clock& clock) : rates(clock, kBucket_s) {}
  RateQuota rates;
  std::atomic<uint64_t> refused{0};  // builds, since the start
};

// With OK and an interruption, which stops what nobody wants any more (WorkStopped), or with the
// reason not to build and null.
using Build = std::function<void(const Status& status, Interruption* interruption)>;

// Calls `build` on a builder thread: with OK, or with the reason not to build: CANCELLED (the
// client has gone, or its deadline has passed), UNAVAILABLE (DRAINING) or RESOURCE_EXHAUSTED
// (BUILD_TIME_EXCEEDED, with retry_after: the tenant has a debt in ServiceContext::build_quota). If
// it throws std::bad_alloc it is called a second time, with RESOURCE_EXHAUSTED (DEVICE_MEMORY), and
// if it throws WorkStopped with CANCELLED or UNAVAILABLE (DRAINING). After an error of PostBuild it
// is never called: RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL or BUILD_TIME_EXCEEDED, with retry_after).
// A build that runs goes on, whatever it takes, while it is wanted.
Status PostBuild(const ServiceContext& context, const Session& session, const Waiter& waiter,
                 Build build);

// OK while what the device has begun, and a server that drains finishes, should go on; otherwise
// why not: CANCELLED. Call it only while the clock exists.
using StopReason = std::function<Status()>;
StopReason ClientStopReason(const Clock& clock, const Waiter& waiter);

}  // namespace drape::api
