#include "server/api/message_slices.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <utility>

namespace drape::api {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedOutputStream;

// Of a tag, or of a length that 64 bits hold.
constexpr size_t kMaxVarintBytes = 10;

uint32_t TagOf(int number) {
  return WireFormatLite::MakeTag(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

}  // namespace

uint64_t ByteSize(const MessageSlices& message) {
  uint64_t bytes = 0;
  for (const grpc::Slice& slice : message) bytes += slice.size();
  return bytes;
}

grpc::ByteBuffer ToByteBuffer(const MessageSlices& message) {
  return {message.data(), message.size()};
}

grpc::Slice SliceOf(std::shared_ptr<const void> owner, std::span<const std::byte> bytes) {
  using Owner = std::shared_ptr<const void>;
  const auto drop = [](void* kept) { delete static_cast<Owner*>(kept); };
  // gRPC only reads them: its type is that of slices whose bytes it has made.
  return {const_cast<std::byte*>(bytes.data()), bytes.size(), drop, new Owner(std::move(owner))};
}

grpc::Slice SliceOf(std::string bytes) {
  const auto owner = std::make_shared<const std::string>(std::move(bytes));
  return SliceOf(owner, std::as_bytes(std::span(*owner)));
}

void MessageWriter::AppendFields(const google::protobuf::MessageLite& message) {
  message.AppendToString(&small_);
}

void MessageWriter::BeginField(int number, uint64_t content_bytes) {
  uint8_t header[2 * kMaxVarintBytes];
  uint8_t* end = CodedOutputStream::WriteVarint32ToArray(TagOf(number), header);
  end = CodedOutputStream::WriteVarint64ToArray(content_bytes, end);
  small_.append(header, end);
}

uint64_t MessageWriter::FieldBytes(int number, uint64_t content_bytes) {
  return CodedOutputStream::VarintSize32(TagOf(number)) +
         CodedOutputStream::VarintSize64(content_bytes) + content_bytes;
}

void MessageWriter::Append(grpc::Slice bytes) {
  FinishSmall();
  slices_.push_back(std::move(bytes));
}

void MessageWriter::Append(const MessageSlices& message) {
  FinishSmall();
  slices_.insert(slices_.end(), message.begin(), message.end());
}

MessageSlices MessageWriter::Finish() && {
  FinishSmall();
  return std::move(slices_);
}

void MessageWriter::FinishSmall() {
  if (!small_.empty()) slices_.emplace_back(std::exchange(small_, {}));
}

}  // namespace drape::api
