// Building scene models on the builder threads, only while somebody waits for it.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

#include "server/api/simulation_service.h"

namespace drape::api {

// Somebody who waits for a build.
struct Waiter {
  CancelToken cancel;
  int64_t deadline_us = std::numeric_limits<int64_t>::max();  // as Caller's
};

// Calls `build` on a builder thread: with OK, or with the reason not to build: CANCELLED (the
// client has gone, or its deadline has passed) or UNAVAILABLE (DRAINING). If it throws
// std::bad_alloc it is called a second time, with RESOURCE_EXHAUSTED (DEVICE_MEMORY). After an
// error of PostBuild it is never called: RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after).
Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const Waiter& waiter, std::function<void(const Status&)> build);

// OK while a waiting or running build should go on; otherwise why it should stop: CANCELLED or
// UNAVAILABLE (DRAINING). Call it only while everything that `context` refers to exists.
using StopReason = std::function<Status()>;
StopReason BuildStopReason(const ServiceContext& context, const Waiter& waiter);
// CANCELLED alone: of what the device has begun, and a server that drains finishes.
StopReason ClientStopReason(const Clock& clock, const Waiter& waiter);

}  // namespace drape::api
