// States that the server keeps by name.
#include <string>
#include <utility>

#include "server/api/cloth_selection.h"
#include "server/api/known_answer.h"
#include "server/api/request_validation.h"
#include "server/api/simulation_service.h"
#include "server/api/snapshot_streams.h"
#include "server/api/unary_call.h"

namespace drape::api {
namespace {

Result<std::vector<ClothId>> CheckSave(const v1::SaveStatesRequest& request) {
  Violations violations;
  CheckSavedName("name", request.name(), violations);
  std::vector<ClothId> ids = CheckSelection(request, FieldPath(), violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return ids;
}

Result<std::vector<ClothId>> CheckLoad(const v1::LoadStatesRequest& request) {
  Violations violations;
  CheckSavedName("name", request.name(), violations);
  std::vector<ClothId> ids = CheckSelection(request, FieldPath(), violations);
  const int count = request.saved_cloth_ids_size();
  violations.Require(count == 0 || count == request.cloth_ids_size(), "saved_cloth_ids", [&] {
    return "has " + std::to_string(count) + " entries; it is empty or has one per cloth (" +
           std::to_string(request.cloth_ids_size()) + ")";
  });
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return ids;
}

Result<v1::SaveStatesResponse> ToAnswer(const Result<SavedSummary>& saved) {
  if (!saved.ok()) return saved.status();
  v1::SaveStatesResponse answer;
  answer.set_cloths(static_cast<uint32_t>(saved->cloths));
  answer.set_bytes(saved->bytes);
  return answer;
}

}  // namespace

grpc::ServerUnaryReactor* SimulationService::SaveStates(Context* context,
                                                        const v1::SaveStatesRequest* request,
                                                        v1::SaveStatesResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Result<std::vector<ClothId>> ids = CheckSave(*request);
  if (!ids.ok()) return Answer(context, ids.status(), tag);
  return DoOnce(context_, caller, tag, *request, response, *ids,
                [request](Session& session, ClothList cloths, const auto& end) {
                  session.SaveStates(
                      std::move(cloths), request->name(),
                      [end](const Result<SavedSummary>& saved) { end(ToAnswer(saved)); });
                });
}

grpc::ServerUnaryReactor* SimulationService::LoadStates(Context* context,
                                                        const v1::LoadStatesRequest* request,
                                                        v1::LoadStatesResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Result<std::vector<ClothId>> ids = CheckLoad(*request);
  if (!ids.ok()) return Answer(context, ids.status(), tag);
  return DoOnce(context_, caller, tag, *request, response, [&](Session& session, const auto& end) {
    session.LoadStates(request->name(), *ids, ToClothIds(request->saved_cloth_ids()),
                       WithoutValue(end));
  });
}

grpc::ServerUnaryReactor* SimulationService::DropStates(Context* context,
                                                        const v1::DropStatesRequest* request,
                                                        v1::DropStatesResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  return DoOnce(context_, caller, tag, *request, response,
                [request](Session& session, const auto& end) {
                  WithoutValue(end)(session.DropStates(request->name()));
                });
}

grpc::ServerWriteReactor<v1::SnapshotChunk>* SimulationService::ExportCloths(
    Context* context, const v1::ExportClothsRequest* request) {
  return ExportCall::Start<ExportCall>("ExportCloths", context_, context_.Identify(*context),
                                       *request);
}

grpc::ServerReadReactor<Unparsed<v1::ImportClothsRequest>>* SimulationService::Import(
    Context* context, v1::ImportClothsResponse* response) {
  return ImportReactor::Start(context_, context_.Identify(*context), response);
}

}  // namespace drape::api
