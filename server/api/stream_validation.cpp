#include "server/api/stream_validation.h"

#include <algorithm>
#include <string>

#include "server/api/cloth_selection.h"
#include "server/api/field_checks.h"

namespace drape::api {
namespace {

constexpr double kMinFrames_hz = 1e-3;
constexpr double kMaxFrames_hz = 1e6;

// Frames of a subscription that wait: one is on its way while the next one is due.
constexpr uint32_t kMinQueuedFrames = 2;
constexpr uint32_t kMaxQueuedFrames = 65536;
constexpr uint64_t kMaxQueuedBytes = uint64_t{1} << 28;

// Rates of a run. Timers are good to about 1 ms: less lateness would drop steps of a server that
// keeps up.
constexpr Range kRunSteps_hz{kMinFrames_hz, kMaxFrames_hz, "Hz"};
constexpr Range kBehind_s{0.02, 60, "s"};
constexpr Range kReportInterval_s{0.01, 3600, "s"};

// None: LATEST.
std::optional<CheckedSubscription::Queue> CheckQueue(
    const FieldPath& path, const v1::StreamStatesRequest::Subscribe& request,
    Violations& violations) {
  CheckKnownEnum(path.Child("delivery"), request.delivery(),
                 v1::StreamStatesRequest::Delivery_descriptor(), violations);
  const bool has_every_frame = request.delivery() == v1::StreamStatesRequest::EVERY_FRAME;
  const auto require_unset = [&](bool is_unset, const char* field, const char* why) {
    violations.Require(is_unset, path.Child(field), [why] { return std::string(why); });
  };
  if (!has_every_frame) {
    const char* why = "must be 0 without delivery EVERY_FRAME";
    require_unset(request.max_queued_frames() == 0, "max_queued_frames", why);
    require_unset(request.max_queued_bytes() == 0, "max_queued_bytes", why);
    return std::nullopt;
  }
  const char* why = "must be 0 with delivery EVERY_FRAME, which leaves no frame out";
  require_unset(request.max_hz() == 0, "max_hz", why);
  require_unset(request.initial_credit() == 0, "initial_credit", why);
  CheckedSubscription::Queue queue;
  if (request.max_queued_frames() != 0) {
    queue.max_frames = request.max_queued_frames();
    violations.InRange(path.Child("max_queued_frames"), queue.max_frames,
                       {kMinQueuedFrames, kMaxQueuedFrames, "frames"});
  }
  if (request.max_queued_bytes() != 0) {
    queue.max_bytes = request.max_queued_bytes();
    violations.Require(queue.max_bytes <= kMaxQueuedBytes, path.Child("max_queued_bytes"), [&] {
      return std::to_string(queue.max_bytes) + " is more than " + std::to_string(kMaxQueuedBytes);
    });
  }
  return queue;
}

}  // namespace

Result<CheckedSubscription> CheckSubscribe(const v1::StreamStatesRequest::Subscribe& request) {
  Violations violations;
  const FieldPath path("subscribe");
  if (request.max_hz() != 0) {
    violations.InRange(path.Child("max_hz"), request.max_hz(),
                       {kMinFrames_hz, kMaxFrames_hz, "Hz"});
  }
  CheckedSubscription result;
  result.view = CheckView(path.Child("view"), request.view(), violations);
  result.cloths = CheckSelection(request, path, violations);
  result.queue = CheckQueue(path, request, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  result.every_n_steps = std::max(request.every_n_steps(), 1u);
  result.max_hz = request.max_hz();
  result.initial_credit = request.initial_credit();
  return result;
}

Result<CheckedRun> CheckRun(const v1::RunRequest::Start& request) {
  Violations violations;
  const FieldPath path("start");
  CheckedRun result;
  result.cloths = CheckSelection(request, path, violations);
  result.is_real_time = request.steps_hz() == 0 && !request.unpaced();
  if (request.steps_hz() != 0 &&
      violations.InRange(path.Child("steps_hz"), request.steps_hz(), kRunSteps_hz)) {
    result.interval_s = 1 / request.steps_hz();
    violations.Require(!request.unpaced(), path.Child("unpaced"),
                       [] { return std::string("must be unset together with steps_hz"); });
  }
  if (request.max_steps() != 0) result.max_steps = request.max_steps();
  if (request.max_behind_s() != 0 &&
      violations.InRange(path.Child("max_behind_s"), request.max_behind_s(), kBehind_s)) {
    result.max_behind_s = request.max_behind_s();
  }
  if (request.report_interval_s() != 0 &&
      violations.InRange(path.Child("report_interval_s"), request.report_interval_s(),
                         kReportInterval_s)) {
    result.report_interval_s = request.report_interval_s();
  }
  if (request.has_expected_step()) result.expected_step = request.expected_step();
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return result;
}

}  // namespace drape::api
