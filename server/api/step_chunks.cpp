#include "server/api/step_chunks.h"

#include <utility>

#include "server/api/step_execution.h"

namespace drape::api {

Status StepChunksCall::Begin(const ServiceContext& context, const Caller& caller,
                             const v1::StepRequest& request) {
  StartStep(
      context, caller, request, AnswerForm::kChunks, cancel_,
      [this](std::shared_ptr<void> held) { held_ = std::move(held); },
      [this](Result<StepAnswer> answer) {
        if (!answer.ok()) return End(answer.status());
        answer_ = std::move(answer).value();
        WriteNext();
      });
  return Status::Ok();
}

bool StepChunksCall::Next(grpc::ByteBuffer* message) {
  if (!answer_.has_next()) return false;
  *message = ToByteBuffer(answer_.Next());
  return true;
}

}  // namespace drape::api
