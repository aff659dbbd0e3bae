// Stepping: one request, a stream of them, or a run of the server.
#include "server/api/run_stream.h"
#include "server/api/simulation_service.h"
#include "server/api/step_chunks.h"
#include "server/api/step_execution.h"
#include "server/api/step_stream.h"
#include "server/api/unary_call.h"

namespace drape::api {

grpc::ServerUnaryReactor* SimulationService::StartStep(Context* context,
                                                       const v1::StepRequest* request,
                                                       grpc::ByteBuffer* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  if (request->in_chunks()) {
    return Answer(context, Status::InvalidField("in_chunks", "must be unset: use StepInChunks"),
                  tag);
  }
  UnaryCall* call = UnaryCall::New(tag);
  api::StartStep(context_, caller, *request, AnswerForm::kMessage, call->cancel, call->hold(),
                 EndWith<StepAnswer>(call, [response](StepAnswer& answer) {
                   *response = ToByteBuffer(answer.Next());
                 }));
  return call;
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* SimulationService::StartStepInChunks(
    Context* context, const v1::StepRequest* request) {
  return StepChunksCall::Start<StepChunksCall>("StepInChunks", context_,
                                               context_.Identify(*context), *request);
}

grpc::ServerBidiReactor<Unparsed<v1::StepRequest>, grpc::ByteBuffer>*
SimulationService::StartStepStream(Context* context) {
  return StepStreamReactor::Start(context_, context_.Identify(*context));
}

grpc::ServerBidiReactor<Unparsed<v1::RunRequest>, v1::RunReport>* SimulationService::StartRun(
    Context* context) {
  return RunReactor::Start(context_, context_.Identify(*context));
}

}  // namespace drape::api
