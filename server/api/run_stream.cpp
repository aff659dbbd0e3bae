#include "server/api/run_stream.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "server/api/status_mapping.h"

namespace drape::api {
namespace {

// Steps that have begun and are not complete, at most. Two keep the device busy.
constexpr uint32_t kStepsUnderWay = 2;

// What a run holds besides its request: a report that is being written.
constexpr uint64_t kReportBytes = 256;

int64_t Microseconds(double s) {
  return static_cast<int64_t>(s * 1e6);
}

// Seconds of one step in real time.
Result<double> RealTime_s(const ClothList& cloths) {
  const double time_step_s = cloths.front()->description()->parameters.settings.time_step_s;
  for (const auto& cloth : cloths) {
    const double other_s = cloth->description()->parameters.settings.time_step_s;
    if (other_s == time_step_s) continue;
    return Status::InvalidField(
        "start.steps_hz", "is needed, because the cloths have different time steps: " +
                              NumberText(time_step_s) + " s and " + NumberText(other_s) + " s");
  }
  return time_step_s;
}

}  // namespace

RunReactor* RunReactor::Start(const ServiceContext& context, Caller caller) {
  const std::shared_ptr<RunReactor> reactor(new RunReactor(context, std::move(caller)));
  reactor->self_ = reactor;
  const grpc::Status opened = context.OpenStream(reactor->caller_, reactor->place_);
  if (!opened.ok()) {
    reactor->ending_ = Status::Ok();  // no second end
    reactor->is_ended_ = true;
    reactor->Finish(opened);
    return reactor.get();
  }
  reactor->Read(&reactor->request_);
  return reactor.get();
}

void RunReactor::OnRequest(bool ok) {
  const std::lock_guard lock(mutex_);
  if (!ok) return Close(Status::Ok());
  if (ending_) return;
  Status status = context_.Parse(request_, caller_.tenant);
  if (status.ok()) status = WithinMemory([&] { return Take(request_.message()); });
  if (!status.ok()) return Close(status);
  Read(&request_);
}

void RunReactor::OnWritten(bool ok) {
  const std::lock_guard lock(mutex_);
  is_writing_ = false;
  if (!ok) return LoseClient();
  WriteNext();
}

void RunReactor::OnCancel() {
  const std::lock_guard lock(mutex_);
  LoseClient();
}

void RunReactor::LoseClient() {
  is_broken_ = true;
  work_.cancel.Cancel();
  Close(ClientHasGone());
}

Status RunReactor::Take(const v1::RunRequest& request) {
  const auto action = request.action_case();
  if (action == v1::RunRequest::ACTION_NOT_SET) {
    return Status::InvalidField("action", "is not set: one of start, pause is needed");
  }
  if ((action == v1::RunRequest::kStart) == pace_.has_value()) {
    return Status::InvalidField(
        "start", pace_ ? "was sent already: once per stream" : "is needed in the first message");
  }
  if (action == v1::RunRequest::kStart) return Begin(request.start());
  pace_->SetPaused(request.pause(), context_.clock.NowUs());
  is_report_due_ = true;
  Advance();
  return Status::Ok();
}

Status RunReactor::Begin(const v1::RunRequest::Start& request) {
  tag_ = RequestTag("Run", caller_, request);
  DRAPE_ASSIGN_OR_RETURN(const CheckedRun checked, CheckRun(request));
  DRAPE_ASSIGN_OR_RETURN(session_, context_.FindSession(caller_, request.session()));
  DRAPE_ASSIGN_OR_RETURN(ClothList cloths, session_->FindCloths(checked.cloths));
  if (cloths.empty()) {
    return Status(StatusCode::kFailedPrecondition, "NO_CLOTHS", "the session has no cloths");
  }
  double interval_s = checked.interval_s;
  if (checked.is_real_time) {
    DRAPE_ASSIGN_OR_RETURN(interval_s, RealTime_s(cloths));
  }
  DRAPE_ASSIGN_OR_RETURN(
      held_, context_.unread->Take(session_->owner(), request.ByteSizeLong() + kReportBytes));
  DRAPE_ASSIGN_OR_RETURN(permit_,
                         context_.scheduler.TakeSubscription(session_->name(), session_->tenant()));
  work_.session = session_->name();
  work_.tenant = session_->tenant();
  work_.steps = 1;
  work_.expected_step = checked.expected_step;
  SetCloths(std::move(cloths));
  max_steps_ = checked.max_steps;
  report_interval_us_ = Microseconds(checked.report_interval_s);
  const int64_t now_us = context_.clock.NowUs();
  pace_.emplace(1e6 * interval_s, Microseconds(checked.max_behind_s), now_us);
  next_report_us_ = now_us;  // the first one says that the run has begun
  ++context_.streams->runs;
  Advance();
  return Status::Ok();
}

void RunReactor::SetCloths(ClothList cloths) {
  cloths_ = std::move(cloths);
  ++generation_;
  work_.cloths.clear();
  for (const auto& cloth : cloths_) work_.cloths.push_back(cloth->runtime);
  work_.done = [self = shared_from_this(), generation = generation_](const StepOutcome& outcome) {
    self->OnStep(outcome.status, generation);
  };
}

void RunReactor::OnStep(const Status& status, uint32_t generation) {
  const std::lock_guard lock(mutex_);
  --under_way_;
  work_.expected_step.reset();
  Status failure;
  if (status.ok()) {
    ++complete_steps_;
  } else if (!ending_) {
    --begun_steps_;
    failure = DropDeleted(status, generation);
  }
  if (!failure.ok()) return Close(failure);
  if (complete_steps_ == max_steps_) return Close(Status::Ok());
  Advance();
}

void RunReactor::OnAlarm() {
  const std::lock_guard lock(mutex_);
  alarm_at_us_.reset();
  Advance();
}

Status RunReactor::DropDeleted(const Status& status, uint32_t generation) {
  if (status.reason() != "CLOTH_NOT_FOUND") return status;
  if (generation != generation_) return Status::Ok();  // they have been left out already
  ClothList left;
  for (const auto& cloth : cloths_) {
    if (session_->FindCloths(std::span(&cloth->id, 1)).ok()) left.push_back(cloth);
  }
  if (left.empty()) {
    return Status(StatusCode::kNotFound, "CLOTH_NOT_FOUND", "every cloth of the run was deleted");
  }
  if (left.size() == cloths_.size()) return status;
  SetCloths(std::move(left));
  return Status::Ok();
}

bool RunReactor::MayBeginStep() const {
  if (ending_ || begun_steps_ == max_steps_) return false;
  // What the first one expects must be true before there is a second.
  return under_way_ < (work_.expected_step ? 1 : kStepsUnderWay);
}

Status RunReactor::BeginStep() {
  Status status = context_.scheduler.Submit(work_);
  if (status.ok()) {
    pace_->Begin();
    ++begun_steps_;
    ++under_way_;
    return status;
  }
  if (status.reason() != "QUEUE_FULL") return status;
  refused_until_us_ = context_.clock.NowUs() + 1000 * status.retry_after_ms().value_or(1);
  return Status::Ok();
}

void RunReactor::Advance() {
  if (ending_) return WriteNext();
  if (context_.scheduler.is_draining()) return Close(DrainingStatus());
  if (const Status status = context_.CheckToken(caller_); !status.ok()) return Close(status);
  const int64_t now_us = context_.clock.NowUs();
  while (MayBeginStep() && now_us >= refused_until_us_ && pace_->IsDue(now_us)) {
    const Status status = BeginStep();
    if (!status.ok()) return Close(status);
  }
  CountDropped();
  if (now_us >= next_report_us_) {
    is_report_due_ = true;
    next_report_us_ = now_us + report_interval_us_;
  }
  WriteNext();
  int64_t wake_us = next_report_us_;
  // Otherwise the end of a step comes first.
  if (MayBeginStep()) {
    const std::optional<int64_t> due_us = pace_->NextDue_us();
    if (due_us) wake_us = std::min(wake_us, std::max(*due_us, refused_until_us_));
  }
  WakeAt(wake_us);
}

void RunReactor::WakeAt(int64_t time_us) {
  if (alarm_at_us_ && *alarm_at_us_ <= time_us) return;
  const int64_t wait_us = std::max<int64_t>(time_us - context_.clock.NowUs(), 0);
  alarm_at_us_ = time_us;
  alarm_ = std::make_unique<grpc::Alarm>();  // cancels the former one
  alarm_->Set(std::chrono::system_clock::now() + std::chrono::microseconds(wait_us),
              [run = weak_from_this()](bool is_time) {
                const std::shared_ptr<RunReactor> alive = run.lock();
                if (is_time && alive) alive->OnAlarm();
              });
}

// The first reason counts. What is under way is finished first: its outcome is in the last report.
void RunReactor::Close(const Status& status) {
  if (!ending_) ending_ = status;
  WriteNext();
}

void RunReactor::CountDropped() {
  context_.streams->run_steps_dropped += pace_->dropped() - counted_drops_;
  counted_drops_ = pace_->dropped();
}

void RunReactor::WriteNext() {
  if (is_writing_ || is_ended_) return;
  const bool is_over = ending_ && under_way_ == 0;
  if (is_over && (is_broken_ || has_last_report_ || !ending_->ok() || !pace_)) {
    is_ended_ = true;
    alarm_.reset();
    if (pace_) --context_.streams->runs;
    work_.done = nullptr;  // which holds this
    session_ = {};
    permit_ = nullptr;
    tag_.Log(*ending_);
    v1::RunReport end;
    end.set_is_end(true);
    return End(ToGrpcStatus(*ending_, {{"steps", std::to_string(complete_steps_)}}), end);
  }
  if (is_broken_ || !pace_ || (!is_over && !is_report_due_)) return;
  is_report_due_ = false;
  has_last_report_ = is_over;
  FillReport(&report_);
  is_writing_ = true;
  StartWrite(&report_);
}

void RunReactor::FillReport(v1::RunReport* report) {
  const int64_t now_us = context_.clock.NowUs();
  if (!ending_ && begun_steps_ < max_steps_) (void)pace_->IsDue(now_us);  // drops what is too late
  CountDropped();
  report->Clear();
  report->set_steps(complete_steps_);
  const uint64_t waiting = std::min(pace_->Waiting(now_us), max_steps_ - begun_steps_);
  report->set_steps_behind(ending_ ? 0 : waiting + under_way_);
  report->set_steps_dropped(pace_->dropped());
  report->set_elapsed_s(1e-6 * static_cast<double>(pace_->Elapsed_us(now_us)));
  report->set_is_paused(pace_->is_paused());
  report->set_is_last(has_last_report_);
  uint64_t lowest = std::numeric_limits<uint64_t>::max(), highest = 0;
  uint32_t faulted = 0;
  for (const auto& cloth : cloths_) {
    const ClothProgress progress = cloth->runtime->progress();
    lowest = std::min(lowest, progress.completed_steps);
    highest = std::max(highest, progress.completed_steps);
    faulted += progress.fault != FaultReason::kNone;
  }
  report->set_lowest_step(lowest);
  report->set_highest_step(highest);
  report->set_cloths(static_cast<uint32_t>(cloths_.size()));
  report->set_faulted_cloths(faulted);
}

}  // namespace drape::api
