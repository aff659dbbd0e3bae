#include "tests/system/calls.h"

#include <google/rpc/status.pb.h>

#include <thread>

namespace drape::test {
namespace {

template <class Detail>
bool FindDetail(const grpc::Status& status, Detail* detail) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return false;
  for (const auto& any : details.details()) {
    if (any.UnpackTo(detail)) return true;
  }
  return false;
}

}  // namespace

std::string ReasonOf(const grpc::Status& status) {
  google::rpc::ErrorInfo error_info;
  return FindDetail(status, &error_info) ? error_info.reason() : "";
}

std::vector<std::string> FieldsOf(const grpc::Status& status) {
  google::rpc::BadRequest bad_request;
  std::vector<std::string> fields;
  if (!FindDetail(status, &bad_request)) return fields;
  for (const auto& violation : bad_request.field_violations()) fields.push_back(violation.field());
  return fields;
}

std::string NewSession(Stub& stub, double ttl_s) {
  v1::CreateSessionRequest request;
  request.set_ttl_s(ttl_s);
  const auto answer = Call(stub, &Stub::CreateSession, request);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  return answer.value.name();
}

v1::CreateClothsRequest HangingSheet(const std::string& session, uint32_t side, uint32_t count) {
  v1::CreateClothsRequest request;
  request.set_session(session);
  request.set_count(count);
  v1::Grid* grid = request.mutable_spec()->mutable_grid();
  grid->set_columns(side);
  grid->set_rows(side);
  grid->set_width_m(1);
  grid->set_height_m(1);
  for (uint32_t k = 0; k < side; ++k) request.mutable_spec()->add_pins()->set_particle(k);
  request.mutable_spec()->mutable_settings()->set_substeps(4);
  return request;
}

Ids Create(Stub& stub, const v1::CreateClothsRequest& request) {
  const auto answer = Call(stub, &Stub::CreateCloths, request);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  return {answer.value.cloth_ids().begin(), answer.value.cloth_ids().end()};
}

v1::StepRequest StepsOf(const std::string& session, const Ids& ids, uint32_t steps) {
  v1::StepRequest request;
  request.set_session(session);
  request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
  request.set_all_cloths(ids.empty());
  request.set_steps(steps);
  return request;
}

std::unique_ptr<grpc::ClientReaderWriter<v1::StepRequest, v1::StepResponse>> BeginEndlessSteps(
    Stub& stub, grpc::ClientContext& context, const std::string& session, const Ids& ids) {
  auto stream = stub.StepStream(&context);
  EXPECT_TRUE(stream->Write(StepsOf(session, ids, 1000000)));
  while (Get(stub, session, ids[0]).step() == 0) std::this_thread::yield();
  return stream;
}

v1::StepResponse Step(Stub& stub, const v1::StepRequest& request) {
  const auto answer = Call(stub, &Stub::Step, request);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  return answer.value;
}

v1::Cloth Get(Stub& stub, const std::string& session, uint64_t id) {
  v1::GetClothRequest request;
  request.set_session(session);
  request.set_cloth_id(id);
  const auto answer = Call(stub, &Stub::GetCloth, request);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  return answer.value;
}

std::vector<v1::StateChunk> Read(Stub& stub, const std::string& session, const Ids& ids) {
  v1::ReadStatesRequest request;
  request.set_session(session);
  request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
  request.mutable_view()->set_positions(true);
  request.mutable_view()->set_velocities(true);
  grpc::ClientContext context;
  const auto reader = stub.ReadStates(&context, request);
  std::vector<v1::StateChunk> chunks;
  v1::StateChunk chunk;
  while (reader->Read(&chunk)) chunks.push_back(chunk);
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return chunks;
}

std::string Bits(Stub& stub, const std::string& session, const Ids& ids) {
  std::string bits;
  for (const v1::StateChunk& chunk : Read(stub, session, ids)) {
    bits += chunk.positions_m().data() + chunk.velocities_m_per_s().data();
  }
  return bits;
}

}  // namespace drape::test
