// Building scene models on the builder threads, only while somebody waits for it.
#pragma once

#include <functional>
#include <string>

#include "server/api/simulation_service.h"

namespace drape::api {

// Calls `build` exactly once, on a builder thread: with OK, or with the reason not to build:
// CANCELLED (the client has gone) or UNAVAILABLE (DRAINING). After an error `build` is never
// called: RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after).
Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const CancelToken& cancel, std::function<void(const Status&)> build);

// OK while a waiting or running build should go on; otherwise why it should stop: CANCELLED or
// UNAVAILABLE (DRAINING). Call it only while everything that `context` refers to exists.
using StopReason = std::function<Status()>;
StopReason BuildStopReason(const ServiceContext& context, const CancelToken& cancel);

}  // namespace drape::api
