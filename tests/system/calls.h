// Short calls of the service for tests: each sends one request and gives back status and answer.
#pragma once

#include <google/rpc/error_details.pb.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "drape/v1/simulation_service.grpc.pb.h"

namespace drape::test {

using Stub = v1::SimulationService::Stub;
using Ids = std::vector<uint64_t>;

template <class Response>
struct Answer {
  grpc::Status status;
  Response value;
};

// Call(stub, &Stub::Step, request). `authorization`, such as "Bearer TOKEN": empty, none is sent.
template <class S, class Request, class Response>
Answer<Response> Call(S& stub,
                      grpc::Status (S::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request, const std::string& authorization = {}) {
  grpc::ClientContext context;
  // A loaded machine may have to compile kernels first. Tenants.ATenantBeyondItsRate... needs less
  // than 256 s.
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(240));
  if (!authorization.empty()) context.AddMetadata("authorization", authorization);
  Answer<Response> answer;
  answer.status = (stub.*method)(&context, request, &answer.value);
  return answer;
}

// The error's ErrorInfo.reason, or "" where there is none.
std::string ReasonOf(const grpc::Status& status);
// The fields of BadRequest.
std::vector<std::string> FieldsOf(const grpc::Status& status);

// These fail the current test on any error.
std::string NewSession(Stub& stub, double ttl_s = 300);
// A hanging sheet of side x side particles, one edge pinned, REALTIME with 4 substeps.
v1::CreateClothsRequest HangingSheet(const std::string& session, uint32_t side = 8,
                                     uint32_t count = 1);
Ids Create(Stub& stub, const v1::CreateClothsRequest& request);
// No ids: every cloth of the session.
v1::StepRequest StepsOf(const std::string& session, const Ids& ids, uint32_t steps);
v1::StepResponse Step(Stub& stub, const v1::StepRequest& request);
v1::Cloth Get(Stub& stub, const std::string& session, uint64_t id);
// A stream with a request for more steps than anybody waits for, of which some are complete.
std::unique_ptr<grpc::ClientReaderWriter<v1::StepRequest, v1::StepResponse>> BeginEndlessSteps(
    Stub& stub, grpc::ClientContext& context, const std::string& session, const Ids& ids);
// All chunks of ReadStates, positions and velocities.
std::vector<v1::StateChunk> Read(Stub& stub, const std::string& session, const Ids& ids);
// Bytes of positions and velocities of the cloths: equal strings mean equal bits.
std::string Bits(Stub& stub, const std::string& session, const Ids& ids);

}  // namespace drape::test
