// ReadStates: the states of some cloths at one moment, in chunks.
#pragma once

#include <memory>
#include <optional>

#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/state_chunks.h"

namespace drape::api {

// Owns itself until gRPC is done with it.
class ReadStatesReactor final : public grpc::ServerWriteReactor<v1::StateChunk> {
 public:
  static ReadStatesReactor* Start(const ServiceContext& context, const Caller& caller,
                                  const v1::ReadStatesRequest& request);

 private:
  ReadStatesReactor() = default;

  Status Begin(const ServiceContext& context, const Caller& caller,
               const v1::ReadStatesRequest& request);
  void OnWriteDone(bool ok) override;
  void OnCancel() override { cancel_.Cancel(); }
  void OnDone() override { delete this; }
  void WriteNext();
  void End(const Status& status);

  RequestTag tag_;
  CancelToken cancel_;  // the client has gone, or its deadline has passed
  SessionLease session_;
  std::shared_ptr<void> held_;  // until the states have been sent
  std::optional<StateChunker> chunker_;
  v1::StateChunk chunk_;
};

}  // namespace drape::api
