// States: read once, or watch.
#include "server/api/read_states.h"
#include "server/api/simulation_service.h"
#include "server/api/state_stream.h"

namespace drape::api {

grpc::ServerWriteReactor<grpc::ByteBuffer>* SimulationService::StartReadStates(
    Context* context, const v1::ReadStatesRequest* request) {
  return ReadStatesCall::Start<ReadStatesCall>("ReadStates", context_, context_.Identify(*context),
                                               *request);
}

grpc::ServerBidiReactor<Unparsed<v1::StreamStatesRequest>, grpc::ByteBuffer>*
SimulationService::StartStateStream(Context* context) {
  return StateStreamReactor::Start(context_, context_.Identify(*context));
}

}  // namespace drape::api
