// Stepping: one request, or a stream of them.
#include "server/api/simulation_service.h"
#include "server/api/step_execution.h"
#include "server/api/step_stream.h"
#include "server/api/unary_call.h"

namespace drape::api {

grpc::ServerUnaryReactor* SimulationService::Step(Context* context, const v1::StepRequest* request,
                                                  v1::StepResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  UnaryCall* call = UnaryCall::New(tag);
  StartStep(context_, caller, *request, call->cancel, call->hold(),
            EndWith<v1::StepResponse>(
                call, [response](v1::StepResponse& answer) { *response = std::move(answer); }));
  return call;
}

grpc::ServerBidiReactor<v1::StepRequest, v1::StepResponse>* SimulationService::StepStream(
    Context* context) {
  return StepStreamReactor::Start(context_, context_.Identify(*context));
}

}  // namespace drape::api
