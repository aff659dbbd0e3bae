#include "server/api/build_queue.h"

#include <new>
#include <utility>

#include "server/api/status_mapping.h"

namespace drape::api {

StopReason ClientStopReason(const Clock& clock, const Waiter& waiter) {
  return [&clock, waiter]() -> Status {
    // The transport may say so late.
    if (clock.NowUs() >= waiter.deadline_us) {
      return {StatusCode::kCancelled, "DEADLINE_PASSED",
              "the deadline of the request passed before it was done"};
    }
    return waiter.cancel.is_cancelled() ? ClientHasGone() : Status::Ok();
  };
}

StopReason BuildStopReason(const ServiceContext& context, const Waiter& waiter) {
  return [&scheduler = context.scheduler,
          client = ClientStopReason(context.clock, waiter)]() -> Status {
    DRAPE_RETURN_IF_ERROR(client());
    if (scheduler.is_draining()) {
      return {StatusCode::kUnavailable, "DRAINING", "the server is shutting down"};
    }
    return Status::Ok();
  };
}

Status PostBuild(const ServiceContext& context, const std::string& session_name,
                 const Waiter& waiter, std::function<void(const Status&)> build) {
  return context.builders.Post(
      session_name, [stop_reason = BuildStopReason(context, waiter), build = std::move(build)] {
        try {
          build(stop_reason());
        } catch (const std::bad_alloc&) {  // not the end of all others
          build({StatusCode::kResourceExhausted, "DEVICE_MEMORY", "the memory has no room"});
        }
      });
}

}  // namespace drape::api
