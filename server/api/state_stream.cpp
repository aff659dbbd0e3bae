#include "server/api/state_stream.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

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
  const grpc::Status opened = context.OpenStream(reactor->caller_, reactor->place_);
  if (!opened.ok()) {
    reactor->ending_ = Status::Ok();  // no frames, and no second end
    reactor->is_ended_ = true;
    reactor->Finish(opened);
    return reactor.get();
  }
  reactor->Read(&reactor->request_);
  return reactor.get();
}

void StateStreamReactor::OnRequest(bool ok) {
  const std::lock_guard lock(mutex_);
  if (!ok) return FinishReading();
  if (ending_) return;
  Status status = context_.Parse(request_, caller_.tenant);
  if (status.ok()) status = WithinMemory([&] { return Take(request_.message()); });
  if (!status.ok()) return Close(status);
  Read(&request_);
}

// With every frame those of all steps that have been answered are still to come.
void StateStreamReactor::FinishReading() {
  if (!has_every_frame_ || !observer_ || ending_) return Close(Status::Ok());
  is_finishing_ = true;
  observer_->Cancel();
}

void StateStreamReactor::OnWritten(bool ok) {
  const std::lock_guard lock(mutex_);
  is_writing_ = false;
  chunk_.Clear();
  if (!ok) return LoseClient();
  if (!frames_.front().chunks.has_next()) {
    last_frame_ = frames_.front().number;
    last_step_ = frames_.front().step;
    frames_.pop_front();
  }
  WriteNext();
}

void StateStreamReactor::OnCancel() {
  const std::lock_guard lock(mutex_);
  LoseClient();
}

void StateStreamReactor::LoseClient() {
  is_broken_ = true;
  Close(ClientHasGone());
}

void StateStreamReactor::OnFrame(ObservedFrame observed) {
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  if (const Status status = context_.CheckToken(caller_); !status.ok()) return Close(status);
  const Status encoded = WithinMemory([&] {
    FrameContent& content = *observed.content;
    // Another stream took the states and got no memory for what it makes of them.
    if (content.encoded == nullptr && content.states.cloths.empty()) return OutOfMemory();
    const EncodedFrame& frame = Encoded(*observed.content);
    frames_.push_back({frame.chunks, observed.frame, observed.frames_dropped, frame.step,
                       std::move(observed.in_flight)});
    return Status::Ok();
  });
  if (!encoded.ok()) return Close(encoded);
  WriteNext();
}

const StateStreamReactor::EncodedFrame& StateStreamReactor::Encoded(FrameContent& content) const {
  if (content.encoded == nullptr) {
    uint64_t step = std::numeric_limits<uint64_t>::max();
    for (const ClothStamp& stamp : content.states.cloths) {
      step = std::min(step, stamp.completed_steps);
    }
    std::vector<ChunkCloth> cloths;
    for (const uint32_t index : content.cloth_indices) cloths.push_back(cloths_[index]);
    StateChunker chunker(std::move(cloths), std::move(content.states),
                         context_.limits.max_chunk_bytes, view_);
    const auto count = [counters = context_.streams] { ++counters->frames_encoded; };
    content.encoded =
        std::make_shared<EncodedFrame>(EncodedFrame{SharedChunks(std::move(chunker), count), step});
  }
  return *static_cast<const EncodedFrame*>(content.encoded.get());
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
  if (has_every_frame_) {
    return Status::InvalidField(action == v1::StreamStatesRequest::kCredit ? "credit" : "pause",
                                "is not for delivery EVERY_FRAME, which leaves no frame out");
  }
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
  view_ = checked.view;
  has_every_frame_ = checked.queue.has_value();
  DRAPE_RETURN_IF_ERROR(ReserveFrames(checked, session->owner(), request.ByteSizeLong(), spec));
  spec.fields = view_.FieldsRead();
  spec.encoding = request.view().SerializeAsString();
  spec.every_n_steps = checked.every_n_steps;
  spec.max_hz = checked.max_hz;
  spec.initial_credit = checked.initial_credit;
  spec.on_frame = [self = shared_from_this()](ObservedFrame frame) {
    self->OnFrame(std::move(frame));
  };
  spec.on_end = [self = shared_from_this()](const Status& status) {
    const std::lock_guard lock(self->mutex_);
    const bool is_finished = self->is_finishing_ && status.code() == StatusCode::kCancelled;
    self->Close(is_finished ? Status::Ok() : status);
  };
  DRAPE_ASSIGN_OR_RETURN(observer_, context_.scheduler.Subscribe(std::move(spec)));
  session_ = std::move(session);
  return Status::Ok();
}

Status StateStreamReactor::ReserveFrames(const CheckedSubscription& checked,
                                         const std::string& owner, uint64_t request_bytes,
                                         ObserverSpec& spec) {
  const ScalarType scalar = context_.scheduler.description().scalar;
  uint64_t bytes = kFramesUnderWay * BytesRead(cloths_, scalar, view_);
  if (checked.queue) {
    FrameQueue queue;
    queue.max_frames = checked.queue->max_frames;
    const StateFields fields = view_.FieldsRead();
    queue.bytes_per_row = 3 * EncodedBytes(v1::StateView::ENCODING_UNSPECIFIED, scalar) *
                          (uint64_t{fields.positions} + uint64_t{fields.velocities});
    queue.bytes_per_cloth = sizeof(ChunkCloth) + sizeof(ClothStamp);
    const uint64_t frame_bytes = bytes / kFramesUnderWay + cloths_.size() * queue.bytes_per_cloth;
    queue.max_bytes = std::max(kFramesUnderWay * frame_bytes, checked.queue->max_bytes);
    spec.queue = queue;
    bytes = std::min(queue.max_bytes, queue.max_frames * frame_bytes);
  }
  DRAPE_ASSIGN_OR_RETURN(held_, context_.unread->Take(owner, request_bytes + bytes));
  return Status::Ok();
}

// The first reason counts. The write under way must end before the stream.
void StateStreamReactor::Close(const Status& status) {
  if (ending_) return WriteNext();
  ending_ = status;
  if (observer_) observer_->Cancel();
  // Who has fallen behind would keep them in memory for as long as it likes.
  if (status.reason() == "SLOW_CONSUMER" && !frames_.empty()) {
    frames_.erase(frames_.begin() + 1, frames_.end());  // the first one is being written
  }
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
    v1::StateChunk end;
    end.set_is_end(true);
    return End(EndStatus(), ToByteBuffer({SliceOf(end.SerializeAsString())}));
  }
  Frame& frame = frames_.front();
  const Status made = WithinMemory([&] {
    v1::StateChunk own;  // parts of a message may follow each other in any order
    own.set_frame(frame.number);
    own.set_frames_dropped(std::exchange(frame.frames_dropped, 0));  // in its first chunk only
    MessageSlices parts = frame.chunks.Next();
    parts.emplace_back(own.SerializeAsString());
    chunk_ = ToByteBuffer(parts);
    return Status::Ok();
  });
  if (!made.ok()) {
    frames_.clear();  // half of it would be no frame
    return Close(made);
  }
  is_writing_ = true;
  StartWrite(&chunk_);
}

grpc::Status StateStreamReactor::EndStatus() const {
  if (!has_every_frame_) return ToGrpcStatus(*ending_);
  return ToGrpcStatus(*ending_, {{"last_frame", std::to_string(last_frame_)},
                                 {"last_step", std::to_string(last_step_)}});
}

}  // namespace drape::api
