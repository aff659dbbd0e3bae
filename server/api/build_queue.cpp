#include "server/api/build_queue.h"

#include <utility>

namespace drape::api {

Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const CancelToken& cancel, std::function<void(const Status&)> build) {
  return context.builders.Post(
      session_name, [&scheduler = context.scheduler, cancel, build = std::move(build)] {
        if (cancel.is_cancelled()) {
          return build(Status(StatusCode::kCancelled, "CANCELLED", "the client has gone"));
        }
        if (scheduler.is_draining()) {
          return build(Status(StatusCode::kUnavailable, "DRAINING", "the server is shutting down"));
        }
        build(Status::Ok());
      });
}

}  // namespace drape::api
