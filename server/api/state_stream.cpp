#include "server/api/state_stream.h"

#include <utility>

#include "server/api/request_validation.h"
#include "server/api/status_mapping.h"
#include "server/api/view_validation.h"

namespace drape::api {
namespace {

// Frames of a subscription that are read and not sent, at most.
constexpr uint64_t kFramesUnderWay = 2;

}  // namespace

StateStreamReactor* StateStreamReactor::Start(const ServiceContext& context, Caller caller) {
  const std::shared_ptr<StateStreamReactor> reactor(
      new StateStreamReactor(context, std::move(caller)));
  reactor->self_ = reactor;
  if (reactor->caller_.is_refused) {
    reactor->ending_ = Status::Ok();  // no frames, and no second end
    reactor->is_ended_ = true;
    reactor->Finish(Unauthenticated());
    return reactor.get();
  }
  reactor->StartRead(&reactor->request_);
  return reactor.get();
}

void StateStreamReactor::OnReadDone(bool ok) {
  const std::lock_guard lock(mutex_);
  if (!ok) return Close(Status::Ok());
  if (ending_) return;
  const Status status = Take(request_);
  if (!status.ok()) return Close(status);
  StartRead(&request_);
}

void StateStreamReactor::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  is_writing_ = false;
  if (!ok) return LoseClient();
  if (!frames_.front().chunker.has_next()) frames_.pop_front();
  WriteNext();
}

void StateStreamReactor::OnCancel() {
  const std::lock_guard lock(mutex_);
  LoseClient();
}

void StateStreamReactor::LoseClient() {
  is_broken_ = true;
  Close(Status(StatusCode::kCancelled, "CANCELLED", "the client has gone"));
}

void StateStreamReactor::OnDone() {
  const std::shared_ptr<StateStreamReactor> last = std::move(self_);
}

void StateStreamReactor::OnFrame(ObservedFrame observed) {
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  std::vector<ChunkCloth> cloths;
  for (const uint32_t index : observed.cloth_indices) cloths.push_back(cloths_[index]);
  frames_.push_back({StateChunker(std::move(cloths), std::move(observed.states),
                                  context_.limits.max_chunk_bytes, view_),
                     observed.frame, observed.frames_dropped, std::move(observed.in_flight)});
  WriteNext();
}

Status StateStreamReactor::Take(const v1::StreamStatesRequest& request) {
  const auto action = request.action_case();
  if (action == v1::StreamStatesRequest::ACTION_NOT_SET) {
    return Status::InvalidField("action", "is not set: one of subscribe, credit, pause is needed");
  }
  if ((action == v1::StreamStatesRequest::kSubscribe) == (observer_ != nullptr)) {
    return Status::InvalidField("subscribe", observer_ ? "was sent already: once per stream"
                                                       : "is needed in the first message");
  }
  if (action == v1::StreamStatesRequest::kSubscribe) return Subscribe(request.subscribe());
  if (action == v1::StreamStatesRequest::kCredit) observer_->AddCredit(request.credit());
  if (action == v1::StreamStatesRequest::kPause) observer_->SetPaused(request.pause());
  return Status::Ok();
}

Status StateStreamReactor::Subscribe(const v1::StreamStatesRequest::Subscribe& request) {
  tag_ = RequestTag("StreamStates", caller_, request);
  DRAPE_ASSIGN_OR_RETURN(const CheckedSubscription checked, CheckSubscribe(request));
  DRAPE_ASSIGN_OR_RETURN(SessionLease session, context_.FindSession(caller_, request.session()));
  DRAPE_ASSIGN_OR_RETURN(const ClothList cloths, session->FindCloths(checked.cloths));
  if (cloths.empty()) {
    return Status(StatusCode::kFailedPrecondition, "NO_CLOTHS", "the session has no cloths");
  }
  DRAPE_RETURN_IF_ERROR(CheckViewFits(FieldPath("subscribe").Child("view"), checked.view, cloths));
  ObserverSpec spec;
  spec.session = session->name();
  spec.tenant = session->tenant();
  for (const auto& cloth : cloths) spec.cloths.push_back(cloth->runtime);
  cloths_ = ChunkClothsOf(cloths, checked.view);
  const uint64_t frame_bytes =
      BytesRead(cloths_, context_.scheduler.description().scalar, checked.view);
  DRAPE_ASSIGN_OR_RETURN(
      held_, context_.unread->Take(session->owner(),
                                   request.ByteSizeLong() + kFramesUnderWay * frame_bytes));
  view_ = checked.view;
  spec.fields = view_.FieldsRead();
  spec.every_n_steps = checked.every_n_steps;
  spec.max_hz = checked.max_hz;
  spec.initial_credit = checked.initial_credit;
  spec.on_frame = [self = shared_from_this()](ObservedFrame frame) {
    self->OnFrame(std::move(frame));
  };
  spec.on_end = [self = shared_from_this()](const Status& status) {
    const std::lock_guard lock(self->mutex_);
    self->Close(status);
  };
  DRAPE_ASSIGN_OR_RETURN(observer_, context_.scheduler.Subscribe(std::move(spec)));
  session_ = std::move(session);
  return Status::Ok();
}

// The first reason counts. The write under way must end before Finish.
void StateStreamReactor::Close(const Status& status) {
  if (ending_) return WriteNext();
  ending_ = status;
  if (observer_) observer_->Cancel();
  session_ = {};
  WriteNext();
}

void StateStreamReactor::WriteNext() {
  if (is_writing_ || is_ended_) return;
  // A frame that was begun is completed unless the client has gone, whatever ended the stream.
  if (frames_.empty() || is_broken_) {
    if (!ending_) return;
    is_ended_ = true;
    frames_.clear();
    tag_.Log(*ending_);
    Finish(ToGrpcStatus(*ending_));
    return;
  }
  Frame& frame = frames_.front();
  frame.chunker.Next(&chunk_);
  chunk_.set_frame(frame.number);
  chunk_.set_frames_dropped(frame.frames_dropped);
  frame.frames_dropped = 0;  // in the frame's first chunk only
  is_writing_ = true;
  StartWrite(&chunk_);
}

}  // namespace drape::api
