#include "server/api/build_queue.h"

#include <utility>

namespace drape::api {

StopReason BuildStopReason(const ServiceContext& context, const CancelToken& cancel) {
  return [&scheduler = context.scheduler, cancel]() -> Status {
    if (cancel.is_cancelled()) {
      return {StatusCode::kCancelled, "CANCELLED", "the client has gone"};
    }
    if (scheduler.is_draining()) {
      return {StatusCode::kUnavailable, "DRAINING", "the server is shutting down"};
    }
    return Status::Ok();
  };
}

Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const CancelToken& cancel, std::function<void(const Status&)> build) {
  return context.builders.Post(session_name, [stop_reason = BuildStopReason(context, cancel),
                                              build = std::move(build)] { build(stop_reason()); });
}

}  // namespace drape::api
