// States: read once, or watch.
#include "server/api/read_states.h"
#include "server/api/simulation_service.h"
#include "server/api/state_stream.h"

namespace drape::api {

grpc::ServerWriteReactor<v1::StateChunk>* SimulationService::ReadStates(
    Context*, const v1::ReadStatesRequest* request) {
  return ReadStatesReactor::Start(context_, *request);
}

grpc::ServerBidiReactor<v1::StreamStatesRequest, v1::StateChunk>* SimulationService::StreamStates(
    Context*) {
  return StateStreamReactor::Start(context_);
}

}  // namespace drape::api
