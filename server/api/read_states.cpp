#include "server/api/read_states.h"

#include <utility>

#include "server/api/request_validation.h"
#include "server/api/view_validation.h"

namespace drape::api {

Status ReadStatesCall::Begin(const ServiceContext& context, const Caller& caller,
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
        Status status = states.status();
        if (status.ok()) {
          status = WithinMemory([&] {
            chunker_.emplace(chunk_cloths, std::move(*states), max_bytes, view);
            return Status::Ok();
          });
        }
        if (!status.ok()) return End(status);
        WriteNext();
      },
      session_->name(), session_->tenant(), cancel_);
}

bool ReadStatesCall::Next(grpc::ByteBuffer* message) {
  if (!chunker_->has_next()) return false;
  *message = ToByteBuffer(chunker_->Next());
  return true;
}

}  // namespace drape::api
