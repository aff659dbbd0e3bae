#include "server/api/build_queue.h"

#include <spdlog/fmt/fmt.h>

#include <memory>
#include <utility>

#include "server/api/status_mapping.h"
#include "server/core/memory_reserve.h"

namespace drape::api {
namespace {

// The time of the builders that one tenant takes.
class BuildTime {
 public:
  // `clock` outlives this.
  BuildTime(std::shared_ptr<BuildQuota> quota, const Clock& clock, std::string tenant)
      : quota_(std::move(quota)), clock_(clock), tenant_(std::move(tenant)) {}

  // Whether it may have more of it now.
  Status Check() const {
    if (quota_ == nullptr) return Status::Ok();
    const int64_t wait_us = quota_->rates.WaitUntil_us(tenant_) - clock_.NowUs();
    if (wait_us <= 0) return Status::Ok();
    ++quota_->refused;
    Status status(StatusCode::kResourceExhausted, "BUILD_TIME_EXCEEDED",
                  fmt::format("max_builder_s_per_s_per_tenant is {:g}: the tenant has had more",
                              quota_->rates.LimitOf(tenant_)));
    return status.RetryAfterMs(wait_us / 1000 + 1);
  }

  template <class Build>
  void Measure(Build build) const {
    const int64_t begin_us = clock_.NowUs();
    build();
    if (quota_ == nullptr) return;
    quota_->rates.Charge(tenant_, static_cast<double>(clock_.NowUs() - begin_us) * 1e-6);
  }

 private:
  std::shared_ptr<BuildQuota> quota_;
  const Clock& clock_;
  std::string tenant_;
};

}  // namespace

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

namespace {

// OK while a waiting or running build should go on; otherwise why it should stop. Call it only
// while everything that `context` refers to exists.
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

// Whether it was ended, or why not.
Status TryBuild(const Build& build, const StopReason& stop_reason) {
  return WithinMemory([&]() -> Status {
    StopWhenUnwanted interruption([&] { return !stop_reason().ok(); });
    try {
      build(Status::Ok(), &interruption);
      return Status::Ok();
    } catch (const WorkStopped&) {
      return stop_reason();  // once there is one, there always is
    }
  });
}

}  // namespace

Status PostBuild(const ServiceContext& context, const Session& session, const Waiter& waiter,
                 Build build) {
  const BuildTime time(context.build_quota, context.clock, session.tenant());
  DRAPE_RETURN_IF_ERROR(time.Check());
  return context.builders.Post(session.owner(), [stop_reason = BuildStopReason(context, waiter),
                                                 time, build = std::move(build)] {
    Status status = stop_reason();
    if (status.ok()) status = time.Check();
    if (!status.ok()) return build(status, nullptr);
    time.Measure([&] {
      const Status built = TryBuild(build, stop_reason);
      if (!built.ok()) build(built, nullptr);
    });
  });
}

}  // namespace drape::api
