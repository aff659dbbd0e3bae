// Stepping: one request, or a stream of them.
#include "server/api/simulation_service.h"
#include "server/api/step_execution.h"
#include "server/api/step_stream.h"
#include "server/api/unary_call.h"

namespace drape::api {

grpc::ServerUnaryReactor* SimulationService::Step(Context*, const v1::StepRequest* request,
                                                  v1::StepResponse* response) {
  UnaryCall* call = UnaryCall::New();
  StartStep(context_, *request, call->cancel,
            EndWith<v1::StepResponse>(
                call, [response](v1::StepResponse& answer) { *response = std::move(answer); }));
  return call;
}

grpc::ServerBidiReactor<v1::StepRequest, v1::StepResponse>* SimulationService::StepStream(
    Context*) {
  return StepStreamReactor::Start(context_);
}

}  // namespace drape::api
