// Building scene models on the builder threads, only while somebody waits for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "server/api/simulation_service.h"
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

// Calls `build` on a builder thread: with OK, or with the reason not to build: CANCELLED (the
// client has gone, or its deadline has passed), UNAVAILABLE (DRAINING) or RESOURCE_EXHAUSTED
// (BUILD_TIME_EXCEEDED, with retry_after: the tenant has a debt in ServiceContext::build_quota). If
// it throws std::bad_alloc it is called a second time, with RESOURCE_EXHAUSTED (DEVICE_MEMORY).
// After an error of PostBuild it is never called: RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL or
// BUILD_TIME_EXCEEDED, with retry_after). A build that runs goes on whatever it takes.
Status PostBuild(const ServiceContext& context, const Session& session, const Waiter& waiter,
                 std::function<void(const Status&)> build);

// OK while a waiting or running build should go on; otherwise why it should stop: CANCELLED or
// UNAVAILABLE (DRAINING). Call it only while everything that `context` refers to exists.
using StopReason = std::function<Status()>;
StopReason BuildStopReason(const ServiceContext& context, const Waiter& waiter);
// CANCELLED alone: of what the device has begun, and a server that drains finishes.
StopReason ClientStopReason(const Clock& clock, const Waiter& waiter);

}  // namespace drape::api
