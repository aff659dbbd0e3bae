// Requests that the service parses itself, after it has seen what they will take.
#pragma once

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <string>

#include "server/api/parsed_size.h"
#include "server/core/byte_budget.h"
#include "server/core/status.h"

namespace drape::api {

// Smaller requests take too little to be looked at [bytes].
inline constexpr uint64_t kSmallRequest_bytes = 1 << 16;

// What gRPC reads in the place of a `Message`: its bytes.
template <class Message>
class Unparsed {
 public:
  bool is_large() const { return bytes_.Length() > kSmallRequest_bytes; }

  // Parses the bytes, once, and drops them. What a large message takes counts in `budget`, for
  // `owner`, until the next one is parsed here or this is gone. RESOURCE_EXHAUSTED if that is more
  // than `most_bytes`, or than the budget has left; INVALID_ARGUMENT (MALFORMED_REQUEST).
  Status Parse(ByteBudget& budget, const std::string& owner, uint64_t most_bytes) {
    // A message that is parsed again keeps the memory of its parts, which does not count any
    // longer.
    if (held_ != nullptr) message_ = Message();
    held_ = nullptr;
    if (is_large()) {
      grpc::ProtoBufferReader reader(&bytes_);
      const uint64_t size_bytes = ParsedSize_bytes(*Message::descriptor(), reader, most_bytes);
      if (size_bytes > most_bytes) return RequestTooLarge(most_bytes);
      DRAPE_ASSIGN_OR_RETURN(held_, budget.Take(owner, size_bytes));
    }
    const grpc::Status parsed = grpc::SerializationTraits<Message>::Deserialize(&bytes_, &message_);
    if (parsed.ok()) return Status::Ok();
    return {StatusCode::kInvalidArgument, "MALFORMED_REQUEST",
            "the bytes of the request are no " + Message::descriptor()->full_name()};
  }

  const Message& message() const { return message_; }
  Message& message() { return message_; }
  grpc::ByteBuffer& bytes() { return bytes_; }

 private:
  grpc::ByteBuffer bytes_;
  Message message_;
  std::shared_ptr<void> held_;
};

}  // namespace drape::api

namespace grpc {

template <class Message>
class SerializationTraits<drape::api::Unparsed<Message>> {
 public:
  static Status Deserialize(ByteBuffer* bytes, drape::api::Unparsed<Message>* request) {
    return SerializationTraits<ByteBuffer>::Deserialize(bytes, &request->bytes());
  }
};

}  // namespace grpc
