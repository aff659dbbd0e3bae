#include "server/api/read_states.h"

#include <utility>

#include "server/api/request_validation.h"
#include "server/api/status_mapping.h"
#include "server/api/view_validation.h"

namespace drape::api {

ReadStatesReactor* ReadStatesReactor::Start(const ServiceContext& context, const Caller& caller,
                                            const v1::ReadStatesRequest& request) {
  auto* reactor = new ReadStatesReactor();
  if (caller.is_refused) {
    reactor->Finish(Unauthenticated());
    return reactor;
  }
  reactor->tag_ = RequestTag(caller, request);
  const Status status = reactor->Begin(context, caller, request);
  if (!status.ok()) reactor->End(status);
  return reactor;
}

Status ReadStatesReactor::Begin(const ServiceContext& context, const Caller& caller,
                                const v1::ReadStatesRequest& request) {
  const FieldPath view_path("view");
  Violations violations;
  const ViewSpec view = CheckView(view_path, request.view(), violations);
  const std::vector<ClothId> ids = CheckSelection(request, FieldPath(), violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  DRAPE_ASSIGN_OR_RETURN(SessionLease session, context.FindSession(caller, request.session()));
  DRAPE_ASSIGN_OR_RETURN(const ClothList cloths, session->FindCloths(ids));
  DRAPE_RETURN_IF_ERROR(CheckViewFits(view_path, view, cloths));
  session_ = std::move(session);
  std::vector<ChunkCloth> chunk_cloths = ChunkClothsOf(cloths, view);
  const uint64_t bytes = request.ByteSizeLong() +
                         BytesRead(chunk_cloths, context.scheduler.description().scalar, view);
  DRAPE_ASSIGN_OR_RETURN(held_, context.unread->Take(session_->owner(), bytes));

  std::vector<std::shared_ptr<ClothRuntime>> runtimes;
  for (const auto& cloth : cloths) runtimes.push_back(cloth->runtime);
  return context.scheduler.ReadStates(
      std::move(runtimes), view.FieldsRead(),
      [this, view, chunk_cloths = std::move(chunk_cloths),
       max_bytes = context.limits.max_chunk_bytes](Result<ClothStates> states) {
        if (!states.ok()) return End(states.status());
        chunker_.emplace(chunk_cloths, std::move(*states), max_bytes, view);
        WriteNext();
      },
      session_->name(), session_->tenant(), cancel_);
}

void ReadStatesReactor::OnWriteDone(bool ok) {
  if (!ok) return End(Status(StatusCode::kCancelled, "CANCELLED", "the client has gone"));
  WriteNext();
}

void ReadStatesReactor::WriteNext() {
  if (!chunker_->has_next()) return End(Status::Ok());
  chunker_->Next(&chunk_);
  StartWrite(&chunk_);
}

void ReadStatesReactor::End(const Status& status) {
  chunker_
      .reset();  // gives back its place among the session's reads before the client can ask again
  held_ = nullptr;
  session_ = {};
  tag_.Log(status);
  Finish(ToGrpcStatus(status));
}

}  // namespace drape::api
