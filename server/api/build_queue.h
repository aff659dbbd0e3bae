// Building scene models on the builder threads, only while somebody waits for it.
#pragma once

#include <functional>
#include <string>

#include "server/api/simulation_service.h"

namespace drape::api {

// `build` runs on a builder thread, exactly once: with OK, or, when nothing shall be built any
// more, with CANCELLED (the client has gone) or UNAVAILABLE (DRAINING). An error means that it will
// not be called: RESOURCE_EXHAUSTED (BUILD_QUEUE_FULL, with retry_after).
Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const CancelToken& cancel, std::function<void(const Status&)> build);

// Why a build that waits or is under way should stop: CANCELLED, UNAVAILABLE (DRAINING); OK: it
// should go on. May be asked as long as what `context` names lives.
using StopReason = std::function<Status()>;
StopReason BuildStopReason(const ServiceContext& context, const CancelToken& cancel);

}  // namespace drape::api
