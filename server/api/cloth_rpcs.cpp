// Cloths: create, look, change, delete, reset.
#include "server/api/cloth_change.h"
#include "server/api/cloth_creation.h"
#include "server/api/known_answer.h"
#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/api/simulation_service.h"
#include "server/api/topology_message.h"
#include "server/api/unary_call.h"
#include "server/api/written_states.h"
#include "server/session/page_token.h"

namespace drape::api {
namespace {

// The session and the cloths that a request names.
struct NamedCloths {
  SessionLease session;
  ClothList cloths;
};

Result<NamedCloths> FindNamed(const ServiceContext& context, const Caller& caller,
                              const std::string& session_name, std::span<const ClothId> ids) {
  DRAPE_ASSIGN_OR_RETURN(SessionLease session, context.FindSession(caller, session_name));
  DRAPE_ASSIGN_OR_RETURN(ClothList cloths, session->FindCloths(ids));
  return NamedCloths{std::move(session), std::move(cloths)};
}

uint64_t BytesOfStates(const ClothList& cloths) {
  uint64_t particles = 0;
  for (const auto& cloth : cloths) particles += cloth->description()->model->particle_count();
  return particles * 2 * sizeof(Eigen::Vector3d);
}

// A page ends early rather than exceed this many bytes: gRPC clients accept 4 MB by default.
constexpr size_t kMaxPageBytes = 1u << 20;

void FillPage(const ClothPage& page, v1::ListClothsResponse* response) {
  size_t bytes = 0;
  for (const auto& cloth : page.cloths) {
    v1::Cloth message = ToProto(*cloth);
    bytes += message.ByteSizeLong();
    if (bytes > kMaxPageBytes && response->cloths_size() > 0) {
      const auto& last = page.cloths[response->cloths_size() - 1];
      response->set_next_page_token(MakePageToken(last->creation_number));
      return;
    }
    *response->add_cloths() = std::move(message);
  }
  response->set_next_page_token(page.next_page_token);
}

}  // namespace

grpc::ServerUnaryReactor* SimulationService::CreateCloths(Context* context,
                                                          const v1::CreateClothsRequest* request,
                                                          v1::CreateClothsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  UnaryCall* call = UnaryCall::New(tag);
  StartCreation(context_, caller, *request, call->cancel, call->hold(),
                EndWith<v1::CreateClothsResponse>(
                    call, [response](auto& answer) { *response = std::move(answer); }));
  return call;
}

grpc::ServerUnaryReactor* SimulationService::GetCloth(Context* context,
                                                      const v1::GetClothRequest* request,
                                                      v1::Cloth* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const ClothId id = ClothId::FromPacked(request->cloth_id());
  const Result<NamedCloths> named = FindNamed(context_, caller, request->session(), {&id, 1});
  if (!named.ok()) return Answer(context, named.status(), tag);
  *response = ToProto(*named->cloths.front());
  return AnswerCounted(*context_.unread, named->session->owner(), *response, tag);
}

grpc::ServerUnaryReactor* SimulationService::ListCloths(Context* context,
                                                        const v1::ListClothsRequest* request,
                                                        v1::ListClothsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Result<SessionLease> session = context_.FindSession(caller, request->session());
  if (!session.ok()) return Answer(context, session.status(), tag);
  const Result<ClothPage> page =
      (*session)->ListCloths(request->page_size(), request->page_token());
  if (!page.ok()) return Answer(context, page.status(), tag);
  FillPage(*page, response);
  return AnswerCounted(*context_.unread, (*session)->owner(), *response, tag);
}

grpc::ServerUnaryReactor* SimulationService::UpdateCloths(Context* context,
                                                          const v1::UpdateClothsRequest* request,
                                                          v1::UpdateClothsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  UnaryCall* call = UnaryCall::New(tag);
  StartUpdate(context_, caller, *request, call->cancel, call->hold(),
              EndWith<v1::UpdateClothsResponse>(
                  call, [response](auto& answer) { *response = std::move(answer); }));
  return call;
}

grpc::ServerUnaryReactor* SimulationService::DeleteCloths(Context* context,
                                                          const v1::DeleteClothsRequest* request,
                                                          v1::DeleteClothsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Status check = CheckNamesCloths(request->cloth_ids());
  if (!check.ok()) return Answer(context, check, tag);
  return DoOnce(context_, caller, tag, *request, response, ToClothIds(request->cloth_ids()),
                [](Session& session, ClothList cloths, const auto& end) {
                  session.DeleteCloths(std::move(cloths), WithoutValue(end));
                });
}

grpc::ServerUnaryReactor* SimulationService::ResetCloths(Context* context,
                                                         const v1::ResetClothsRequest* request,
                                                         v1::ResetClothsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  Result<CheckedReset> reset = CheckReset(*request);
  if (!reset.ok()) return Answer(context, reset.status(), tag);
  return DoOnce(context_, caller, tag, *request, response, reset->cloths,
                [&](Session& session, ClothList cloths, const auto& end) {
                  session.ResetCloths(std::move(cloths), std::move(reset->starts),
                                      WithoutValue(end));
                });
}

grpc::ServerUnaryReactor* SimulationService::WriteStates(Context* context,
                                                         const v1::WriteStatesRequest* request,
                                                         v1::WriteStatesResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Status check = CheckWriteStates(*request);
  if (!check.ok()) return Answer(context, check, tag);
  return DoOnce(context_, caller, tag, *request, response, ToClothIds(request->cloth_ids()),
                [this, request](Session& session, const ClothList& cloths, const auto& end) {
                  // In double precision, until the device has taken them.
                  auto held = context_.unread->Take(session.owner(), BytesOfStates(cloths));
                  if (!held.ok()) return end(held.status());
                  Result<std::vector<ParticleState>> states = ToStates(*request, cloths);
                  if (!states.ok()) return end(states.status());
                  session.WriteStates(cloths, std::move(*states),
                                      [done = WithoutValue(end), held = std::move(*held)](
                                          const Status& status) { done(status); });
                });
}

grpc::ServerUnaryReactor* SimulationService::ReadTopology(Context* context,
                                                          const v1::ReadTopologyRequest* request,
                                                          v1::Topology* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const ClothId id = ClothId::FromPacked(request->cloth_id());
  const Result<NamedCloths> named = FindNamed(context_, caller, request->session(), {&id, 1});
  if (!named.ok()) return Answer(context, named.status(), tag);
  *response = TopologyOf(*named->cloths.front());
  return AnswerCounted(*context_.unread, named->session->owner(), *response, tag);
}

}  // namespace drape::api
