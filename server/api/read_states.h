// ReadStates: the states of some cloths at one moment, in chunks.
#pragma once

#include <optional>

#include "server/api/chunked_call.h"
#include "server/api/state_chunks.h"

namespace drape::api {

class ReadStatesCall final : public ChunkedCall<grpc::ByteBuffer> {
 private:
  friend ChunkedCall;

  Status Begin(const ServiceContext& context, const Caller& caller,
               const v1::ReadStatesRequest& request);
  bool Next(grpc::ByteBuffer* message) override;
  // Also its place among the session's reads.
  void DropAnswer() override { chunker_.reset(); }

  std::optional<StateChunker> chunker_;
};

}  // namespace drape::api
