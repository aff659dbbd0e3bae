// Stepping: one request, a stream of them, or a run of the server.
#include "server/api/run_stream.h"
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

grpc::ServerBidiReactor<v1::RunRequest, v1::RunReport>* SimulationService::Run(Context* context) {
  return RunReactor::Start(context_, context_.Identify(*context));
}

}  // namespace drape::api
