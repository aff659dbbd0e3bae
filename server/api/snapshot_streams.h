// ExportCloths and ImportCloths: the bytes of a snapshot, in chunks.
#pragma once

#include <memory>
#include <string>

#include "server/api/chunked_call.h"

namespace drape::api {

// The bytes count in max_saved_bytes while it lives.
class ExportCall final : public ChunkedCall<v1::SnapshotChunk> {
 private:
  friend ChunkedCall;

  Status Begin(const ServiceContext& context, const Caller& caller,
               const v1::ExportClothsRequest& request);
  // Builder thread.
  Status Make(const ServiceContext& context, const SavedStates& saved, Interruption* interruption);
  bool Next(v1::SnapshotChunk* message) override;
  void DropAnswer() override { bytes_ = {}; }

  std::string bytes_;
  uint64_t next_ = 0;       // of them
  bool has_begun_ = false;  // a message has left, if it was empty
  uint64_t max_chunk_bytes_ = 0;
};

// Owns itself until gRPC is done with it. What has come counts, too; the session lives while it is
// under way.
class ImportReactor final : public grpc::ServerReadReactor<Unparsed<v1::ImportClothsRequest>> {
 public:
  static ImportReactor* Start(const ServiceContext& context, Caller caller,
                              v1::ImportClothsResponse* response);

 private:
  ImportReactor(const ServiceContext& context, Caller caller, v1::ImportClothsResponse* response)
      : context_(context), caller_(std::move(caller)), response_(response) {}

  void OnReadDone(bool ok) override;
  void OnCancel() override { cancel_.Cancel(); }
  void OnDone() override { delete this; }
  // What a message brings.
  Status Take(v1::ImportClothsRequest& request);
  Status Begin(const v1::ImportClothsRequest::Begin& begin);
  // All bytes are there.
  void Import();
  // Ends with the answer if it is known already. True: to be done.
  bool IsNew();
  void Create(std::vector<SavedCloth> cloths, Interruption* interruption);
  void End(const Status& status);

  const ServiceContext& context_;
  const Caller caller_;
  v1::ImportClothsResponse* const response_;
  SessionLease session_;
  RequestTag tag_;
  CancelToken cancel_;
  std::shared_ptr<void> place_;  // ServiceContext::OpenStream
  std::shared_ptr<void> held_;
  v1::ImportClothsRequest::Begin begin_;
  std::string bytes_;
  bool is_remembered_ = false;  // the session remembers the request_id, and waits for the answer
  Unparsed<v1::ImportClothsRequest> request_;
};

}  // namespace drape::api
