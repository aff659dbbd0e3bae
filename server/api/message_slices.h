// Serialised messages in pieces: what is long stays where it is and is shared, not copied.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace drape::api {

// The bytes of a message, piece after piece. Copies share them; any thread.
using MessageSlices = std::vector<grpc::Slice>;

uint64_t ByteSize(const MessageSlices& message);
// What gRPC writes.
grpc::ByteBuffer ToByteBuffer(const MessageSlices& message);

// The bytes, which `owner` keeps in place, without a copy. The last one who needs them drops the
// owner, on any thread.
grpc::Slice SliceOf(std::shared_ptr<const void> owner, std::span<const std::byte> bytes);
grpc::Slice SliceOf(std::string bytes);

// Writes a message field by field, in any order: that is what readers of protobuf take. Each field
// is written whole, once, because some readers do not merge the parts of one.
class MessageWriter {
 public:
  // The fields that are set, all but those that are written otherwise.
  void AppendFields(const google::protobuf::MessageLite& message);
  // The begin of a field of bytes, a string or a message; as many bytes must follow.
  void BeginField(int number, uint64_t content_bytes);
  static uint64_t FieldBytes(int number, uint64_t content_bytes);
  void Append(grpc::Slice bytes);
  void Append(const MessageSlices& message);

  MessageSlices Finish() &&;

 private:
  void FinishSmall();

  MessageSlices slices_;
  std::string small_;  // what comes after them, up to the next slice
};

}  // namespace drape::api
