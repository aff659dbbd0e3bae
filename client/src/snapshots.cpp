// The methods of Session that take snapshots of cloths and make cloths of them.
#include <algorithm>
#include <utility>

#include "client/src/connection.h"
#include "client/src/errors.h"
#include "client/src/session_impl.h"
#include "drape/session.h"

namespace drape {
inline namespace client {
namespace {

// How often an export that has brought something goes on, although its tries are over.
constexpr uint32_t kMaxCuts = 16;
// Of a message to the server.
constexpr size_t kPieceBytes = size_t{4} << 20;

}  // namespace

std::string Session::Impl::Export(const std::string& saved_name) const {
  v1::ExportClothsRequest request;
  request.set_session(name);
  request.set_name(saved_name);
  std::string bytes;
  const auto more = [&](grpc::ClientContext* context) {
    request.set_offset(bytes.size());
    const auto reader = connection->stub->ExportCloths(context, request);
    for (v1::SnapshotChunk chunk; reader->Read(&chunk);) bytes += chunk.data();
    return reader->Finish();
  };
  for (uint32_t cuts = 0;; ++cuts) {
    const size_t before = bytes.size();
    try {
      Send(IfSentTwice(request), more);
      return bytes;
    } catch (const Error& error) {
      const bool goes_on = error.code() == ErrorCode::kUnavailable && cuts < kMaxCuts &&
                           bytes.size() > before && connection->options.retries.max_tries > 1;
      if (!goes_on) throw;
    }
  }
}

std::string Session::TakeSnapshot(std::span<const ClothId> cloths) const {
  // Names and ids of their own: a repetition saves and drops nothing else.
  v1::SaveStatesRequest save;
  save.set_name("snapshot-" + impl_->connection->request_ids->Next());
  save.set_request_id(save.name());
  save.set_all_cloths(cloths.empty());
  save.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  impl_->Call(&v1::SimulationService::Stub::SaveStates, save);
  const auto drop = [&] {
    v1::DropStatesRequest request;
    request.set_name(save.name());
    request.set_request_id(impl_->connection->request_ids->Next());
    try {
      impl_->Call(&v1::SimulationService::Stub::DropStates, std::move(request));
    } catch (const Error&) {
      // Then it stays as long as the session.
    }
  };
  try {
    std::string bytes = impl_->Export(save.name());
    drop();
    return bytes;
  } catch (const Error&) {
    drop();
    throw;
  }
}

RestoredCloths Session::Restore(std::string_view snapshot, bool inexact,
                                const std::string& request_id) {
  v1::ImportClothsRequest first;
  first.mutable_begin()->set_session(impl_->name);
  first.mutable_begin()->set_inexact(inexact);
  first.mutable_begin()->set_total_bytes(snapshot.size());
  first.mutable_begin()->set_request_id(request_id);
  impl_->GiveId(first.mutable_begin());
  v1::ImportClothsResponse response;
  impl_->Send(IfSentTwice(first.begin()), [&](grpc::ClientContext* context) {
    const auto writer = impl_->connection->stub->ImportCloths(context, &response);
    bool is_open = writer->Write(first);
    v1::ImportClothsRequest request;
    for (std::string_view rest = snapshot; is_open && !rest.empty();) {
      const std::string_view piece = rest.substr(0, kPieceBytes);
      request.set_data(piece.data(), piece.size());
      rest.remove_prefix(piece.size());
      is_open = writer->Write(request);
    }
    writer->WritesDone();
    return writer->Finish();
  });
  return {{response.cloth_ids().begin(), response.cloth_ids().end()},
          {response.former_cloth_ids().begin(), response.former_cloth_ids().end()}};
}

}  // namespace client
}  // namespace drape
