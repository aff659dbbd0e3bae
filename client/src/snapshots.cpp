// The methods of Session that take snapshots of cloths and make cloths of them.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "client/src/connection.h"
#include "client/src/errors.h"
#include "client/src/session_impl.h"
#include "drape/session.h"

namespace drape {
inline namespace client {
namespace {

// How often an export that was cut goes on.
constexpr uint32_t kMaxCuts = 16;
// Of a message to the server.
constexpr size_t kPieceBytes = size_t{4} << 20;

// A name that no other snapshot of this process has.
std::string TemporaryName() {
  static std::atomic<uint64_t> next{0};
  const auto now = std::chrono::system_clock::now().time_since_epoch().count();
  return "snapshot-" + std::to_string(now) + "-" + std::to_string(next++);
}

// Appends what has come of the export of `name`.
grpc::Status ExportMore(const Connection& connection, const SessionRoute& route,
                        const std::string& name, std::string& bytes) {
  v1::ExportClothsRequest request;
  request.set_session(route.session);
  request.set_name(name);
  request.set_offset(bytes.size());
  grpc::ClientContext context;
  connection.Prepare(&context, route);
  const auto reader = connection.stub->ExportCloths(&context, request);
  for (v1::SnapshotChunk chunk; reader->Read(&chunk);) bytes += chunk.data();
  return reader->Finish();
}

// Keeps the cloths under a name of its own while it lives.
class SavedName {
 public:
  SavedName(const Connection& connection, const SessionRoute& route,
            std::span<const ClothId> cloths)
      : connection_(connection), route_(route), name_(TemporaryName()) {
    v1::SaveStatesRequest request;
    request.set_session(route_.session);
    request.set_name(name_);
    request.set_all_cloths(cloths.empty());
    request.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
    grpc::ClientContext context;
    connection_.Prepare(&context, route_);
    v1::SaveStatesResponse response;
    ThrowIfFailed(connection_.stub->SaveStates(&context, request, &response));
  }
  ~SavedName() {
    v1::DropStatesRequest request;
    request.set_session(route_.session);
    request.set_name(name_);
    grpc::ClientContext context;
    connection_.Prepare(&context, route_);
    v1::DropStatesResponse response;
    (void)connection_.stub->DropStates(&context, request, &response);
  }
  SavedName(const SavedName&) = delete;
  SavedName& operator=(const SavedName&) = delete;
  const std::string& name() const { return name_; }

 private:
  const Connection& connection_;
  const SessionRoute route_;
  const std::string name_;
};

}  // namespace

std::string Session::TakeSnapshot(std::span<const ClothId> cloths) const {
  const SessionRoute route = impl_->Route();
  const SavedName saved(*impl_->connection, route, cloths);
  std::string bytes;
  for (uint32_t cuts = 0;; ++cuts) {
    const size_t before = bytes.size();
    const grpc::Status status = ExportMore(*impl_->connection, route, saved.name(), bytes);
    if (status.ok()) return bytes;
    const bool goes_on = status.error_code() == grpc::StatusCode::UNAVAILABLE && cuts < kMaxCuts &&
                         bytes.size() > before;
    if (!goes_on) ThrowIfFailed(status);
  }
}

RestoredCloths Session::Restore(std::string_view snapshot, bool inexact,
                                const std::string& request_id) {
  grpc::ClientContext context;
  impl_->connection->Prepare(&context, impl_->Route());
  v1::ImportClothsResponse response;
  const auto writer = impl_->connection->stub->ImportCloths(&context, &response);
  v1::ImportClothsRequest request;
  request.mutable_begin()->set_session(impl_->name);
  request.mutable_begin()->set_inexact(inexact);
  request.mutable_begin()->set_total_bytes(snapshot.size());
  request.mutable_begin()->set_request_id(request_id);
  bool is_open = writer->Write(request);
  while (is_open && !snapshot.empty()) {
    const std::string_view piece = snapshot.substr(0, kPieceBytes);
    request.set_data(piece.data(), piece.size());
    snapshot.remove_prefix(piece.size());
    is_open = writer->Write(request);
  }
  writer->WritesDone();
  ThrowIfFailed(writer->Finish());
  return {{response.cloth_ids().begin(), response.cloth_ids().end()},
          {response.former_cloth_ids().begin(), response.former_cloth_ids().end()}};
}

}  // namespace client
}  // namespace drape
