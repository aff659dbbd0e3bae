// StepInChunks: one step request, whose answer comes in several messages.
#pragma once

#include "server/api/chunked_call.h"
#include "server/api/step_answer.h"

namespace drape::api {

class StepChunksCall final : public ChunkedCall<grpc::ByteBuffer> {
 private:
  friend ChunkedCall;

  Status Begin(const ServiceContext& context, const Caller& caller, const v1::StepRequest& request);
  bool Next(grpc::ByteBuffer* message) override;
  void DropAnswer() override { answer_ = {}; }

  StepAnswer answer_;
};

}  // namespace drape::api
