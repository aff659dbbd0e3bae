#include "server/api/snapshot_streams.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/api/build_queue.h"
#include "server/api/known_answer.h"
#include "server/api/snapshot_reading.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_writing.h"
#include "server/api/status_mapping.h"

namespace drape::api {

Status ExportCall::Begin(const ServiceContext& context, const Caller& caller,
                         const v1::ExportClothsRequest& request) {
  DRAPE_ASSIGN_OR_RETURN(session_, context.FindSession(caller, request.session()));
  std::shared_ptr<const SavedStates> saved = session_->FindSaved(request.name());
  if (saved == nullptr) return SavedStatesNotFound(request.name());
  next_ = request.offset();
  max_chunk_bytes_ = context.limits.max_chunk_bytes;
  return PostBuild(
      context, *session_.session(), {cancel_, caller.deadline_us},
      [this, &context, saved = std::move(saved)](const Status& status, Interruption* interruption) {
        const Status made = status.ok() ? Make(context, *saved, interruption) : status;
        if (!made.ok()) return End(made);
        WriteNext();
      });
}

Status ExportCall::Make(const ServiceContext& context, const SavedStates& saved,
                        Interruption* interruption) {
  ByteBudget& budget = session_->saved_budget();
  // Of what has states of a few bytes, the models and meshes may take as much as they please.
  std::vector<std::shared_ptr<void>> permits;
  uint64_t counted = 0;
  const auto count = [&](uint64_t bytes) -> Status {
    Ask(interruption);  // before each record
    if (bytes <= counted) return Status::Ok();
    DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit,
                           budget.Take(session_->owner(), bytes - counted));
    permits.push_back(std::move(permit));
    counted = bytes;
    return Status::Ok();
  };
  // A builder must not write the states only to find that there is no room.
  DRAPE_RETURN_IF_ERROR(count(saved.bytes));
  DRAPE_ASSIGN_OR_RETURN(
      bytes_, WriteSnapshot(saved, context.scheduler.description(), context.version, count));
  permits.clear();
  DRAPE_ASSIGN_OR_RETURN(held_, budget.Take(session_->owner(), bytes_.size()));
  if (next_ <= bytes_.size()) return Status::Ok();
  return Status::InvalidField("offset", std::to_string(next_) +
                                            " is beyond the snapshot, which has " +
                                            std::to_string(bytes_.size()) + " bytes");
}

bool ExportCall::Next(v1::SnapshotChunk* message) {
  if (std::exchange(has_begun_, true) && next_ == bytes_.size()) return false;
  const uint64_t count = std::min<uint64_t>(max_chunk_bytes_, bytes_.size() - next_);
  message->set_offset(next_);
  message->set_data(bytes_.substr(next_, count));
  message->set_total_bytes(bytes_.size());
  next_ += count;
  return true;
}

ImportReactor* ImportReactor::Start(const ServiceContext& context, Caller caller,
                                    v1::ImportClothsResponse* response) {
  auto* reactor = new ImportReactor(context, std::move(caller), response);
  const grpc::Status opened = context.OpenStream(reactor->caller_, reactor->place_);
  if (!opened.ok()) {
    reactor->Finish(opened);
  } else {
    reactor->StartRead(&reactor->request_);
  }
  return reactor;
}

void ImportReactor::OnReadDone(bool ok) {
  if (!ok) {
    if (cancel_.is_cancelled()) return End(ClientHasGone());
    return Import();
  }
  Status status = context_.Parse(request_, caller_.tenant);
  if (status.ok()) status = WithinMemory([&] { return Take(request_.message()); });
  if (!status.ok()) return End(status);
  StartRead(&request_);
}

Status ImportReactor::Take(v1::ImportClothsRequest& request) {
  if (request.has_begin()) {
    if (session_) return Status::InvalidField("begin", "comes once, in the first message");
    return Begin(request.begin());
  }
  if (!session_) return Status::InvalidField("begin", "is needed in the first message");
  if (request.data().size() > begin_.total_bytes() - bytes_.size()) {
    return Status::InvalidField(
        "data", "more has come than total_bytes = " + std::to_string(begin_.total_bytes()));
  }
  bytes_ += request.data();
  request.Clear();
  return Status::Ok();
}

Status ImportReactor::Begin(const v1::ImportClothsRequest::Begin& begin) {
  tag_ = RequestTag("ImportCloths", caller_, begin);
  if (begin.total_bytes() == 0) {
    return Status::InvalidField("begin.total_bytes",
                                "is 0: the snapshot is empty, or nobody has told its size");
  }
  DRAPE_ASSIGN_OR_RETURN(SessionLease session, context_.FindSession(caller_, begin.session()));
  DRAPE_ASSIGN_OR_RETURN(held_,
                         session->saved_budget().Take(session->owner(), begin.total_bytes()));
  bytes_.reserve(begin.total_bytes());  // no more than counts: it would grow by doubling
  session_ = std::move(session);
  begin_ = begin;
  return Status::Ok();
}

void ImportReactor::Import() {
  if (!session_) return End(Status::InvalidField("begin", "is needed in the first message"));
  if (bytes_.size() < begin_.total_bytes()) {
    return End(SnapshotDamaged("only " + std::to_string(bytes_.size()) + " of its " +
                               std::to_string(begin_.total_bytes()) + " bytes have come"));
  }
  if (!IsNew()) return;
  const Waiter waiter{cancel_, caller_.deadline_us};
  const Status posted = PostBuild(context_, *session_.session(), waiter,
                                  [this](const Status& status, Interruption* interruption) {
                                    if (!status.ok()) return End(status);
                                    Result<std::vector<SavedCloth>> cloths = ReadSnapshot(
                                        bytes_, {context_.scheduler.description(), context_.limits,
                                                 interruption, *session_, begin_.inexact()});
                                    if (!cloths.ok()) return End(cloths.status());
                                    Create(std::move(*cloths), interruption);
                                  });
  if (!posted.ok()) End(posted);
}

bool ImportReactor::IsNew() {
  auto known = BeginRequest<v1::ImportClothsResponse>(session_->request_memory(),
                                                      begin_.request_id(), begin_, bytes_);
  if (known.ok() && !known->has_value()) {
    is_remembered_ = !begin_.request_id().empty();
    return true;
  }
  if (known.ok()) *response_ = std::move(**known);
  End(known.status());
  return false;
}

void ImportReactor::Create(std::vector<SavedCloth> cloths, Interruption* interruption) {
  bytes_ = {};
  for (const SavedCloth& cloth : cloths) response_->add_former_cloth_ids(cloth.id.Packed());
  session_->ImportCloths(
      std::move(cloths),
      [this](const Result<std::vector<ClothId>>& ids) {
        if (!ids.ok()) return End(ids.status());
        for (const ClothId id : *ids) response_->add_cloth_ids(id.Packed());
        End(Status::Ok());
      },
      interruption);
}

void ImportReactor::End(const Status& status) {
  if (is_remembered_) {
    using Answer = Result<v1::ImportClothsResponse>;
    EndRequest(session_->request_memory(), begin_.request_id(),
               status.ok() ? Answer(*response_) : Answer(status));
  }
  bytes_ = {};
  held_ = nullptr;
  session_ = {};
  tag_.Log(status);
  Finish(ToGrpcStatus(status));
}

}  // namespace drape::api
