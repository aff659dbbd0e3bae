#include "server/api/step_stream.h"

#include <utility>

#include "server/api/status_mapping.h"
#include "server/api/step_execution.h"

namespace drape::api {

StepStreamReactor* StepStreamReactor::Start(const ServiceContext& context, Caller caller) {
  const std::shared_ptr<StepStreamReactor> reactor(
      new StepStreamReactor(context, std::move(caller)));
  reactor->self_ = reactor;
  const std::lock_guard lock(reactor->mutex_);
  const grpc::Status opened = context.OpenStream(reactor->caller_, reactor->place_);
  if (!opened.ok()) {
    reactor->is_ended_ = true;
    reactor->Finish(opened);
  }
  reactor->ReadNext();
  return reactor.get();
}

void StepStreamReactor::OnRequest(bool ok) {
  Status parsed = ok ? context_.CheckToken(caller_) : Status::Ok();
  if (ok && parsed.ok()) parsed = context_.Parse(request_, caller_.tenant);
  const v1::StepRequest& request = request_.message();
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    if (ok && !is_ended_ && !is_broken_) {
      slot = slots_.emplace_back(std::make_shared<Slot>());
      if (parsed.ok()) slot->tag = RequestTag(caller_, request);
    } else {
      is_reading_ = false;
      is_read_over_ = !ok;
      WriteNext();
    }
  }
  if (!slot) return;
  // Without the lock: the answer may come before StartStep returns. is_reading_ is still set, so no
  // other thread reads the next request, which would overwrite this one or overtake it.
  const auto done = [self = shared_from_this(), slot](Result<StepAnswer> answer) {
    self->OnAnswer(*slot, std::move(answer));
  };
  if (parsed.ok()) {
    StartStep(
        context_, caller_, request,
        request.in_chunks() ? AnswerForm::kChunks : AnswerForm::kMessage, slot->cancel,
        [slot](std::shared_ptr<void> held) { slot->held = std::move(held); }, done);
  } else {
    done(parsed);
  }
  const std::lock_guard lock(mutex_);
  is_reading_ = false;
  ReadNext();
}

void StepStreamReactor::OnAnswer(Slot& slot, Result<StepAnswer> answer) {
  slot.tag.Log(answer.status());
  const std::lock_guard lock(mutex_);
  slot.answer = std::move(answer);
  WriteNext();
}

void StepStreamReactor::OnWritten(bool ok) {
  const std::lock_guard lock(mutex_);
  is_writing_ = false;
  response_.Clear();
  held_ = nullptr;
  if (!ok) is_broken_ = true;
  ReadNext();
  WriteNext();
}

void StepStreamReactor::OnCancel() {
  const std::lock_guard lock(mutex_);
  is_broken_ = true;
  CancelAll();
  WriteNext();
}

void StepStreamReactor::ReadNext() {
  if (is_reading_ || is_read_over_ || is_broken_ || is_ended_) return;
  if (slots_.size() >= context_.limits.max_pipelined_steps) return;
  is_reading_ = true;
  Read(&request_);
}

void StepStreamReactor::WriteNext() {
  if (is_writing_ || is_ended_) return;
  if (is_broken_) return Close(ClientHasGone());
  if (slots_.empty()) {
    if (is_read_over_) Close(Status::Ok());
    return;
  }
  Slot& first = *slots_.front();
  if (!first.answer) return;
  if (!first.answer->ok()) {
    const Status status = first.answer->status();
    slots_.pop_front();
    return Close(status);
  }
  const Status made = WithinMemory([&] {
    response_ = ToByteBuffer(first.answer->value().Next());
    return Status::Ok();
  });
  if (!made.ok()) return Close(made);
  is_writing_ = true;
  if (!first.answer->value().has_next()) {
    held_ = std::move(first.held);
    slots_.pop_front();
  }
  StartWrite(&response_);
  ReadNext();
}

void StepStreamReactor::CancelAll() {
  for (const auto& slot : slots_) slot->cancel.Cancel();
}

void StepStreamReactor::Close(const Status& status) {
  is_ended_ = true;
  CancelAll();
  v1::StepResponse end;
  end.set_is_end(true);
  End(ToGrpcStatus(status), ToByteBuffer({SliceOf(end.SerializeAsString())}));
}

}  // namespace drape::api
