#include "server/api/step_chunks.h"

#include <utility>

#include "server/api/status_mapping.h"
#include "server/api/step_execution.h"

namespace drape::api {

StepChunksReactor* StepChunksReactor::Start(const ServiceContext& context, const Caller& caller,
                                            const v1::StepRequest& request) {
  auto* reactor = new StepChunksReactor();
  if (caller.is_refused) {
    reactor->Finish(Unauthenticated());
    return reactor;
  }
  reactor->tag_ = RequestTag("StepInChunks", caller, request);
  StartStep(
      context, caller, request, AnswerForm::kChunks, reactor->cancel_,
      [reactor](std::shared_ptr<void> held) { reactor->held_ = std::move(held); },
      [reactor](Result<StepAnswer> answer) {
        if (!answer.ok()) return reactor->End(answer.status());
        reactor->answer_ = std::move(answer).value();
        reactor->WriteNext();
      });
  return reactor;
}

void StepChunksReactor::OnWriteDone(bool ok) {
  if (!ok) return End(Status(StatusCode::kCancelled, "CANCELLED", "the client has gone"));
  WriteNext();
}

void StepChunksReactor::WriteNext() {
  if (!answer_.has_next()) return End(Status::Ok());
  answer_.Next(&message_);
  StartWrite(&message_);
}

void StepChunksReactor::End(const Status& status) {
  answer_ = {};
  held_ = nullptr;
  tag_.Log(status);
  Finish(ToGrpcStatus(status));
}

}  // namespace drape::api
