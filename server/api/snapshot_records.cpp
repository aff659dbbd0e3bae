#include "server/api/snapshot_records.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <cstring>
#include <limits>
#include <utility>

#include "server/api/parsed_size.h"
#include "server/api/sha256.h"

namespace drape::api {
namespace {

constexpr std::string_view kMagic = "DRAPESNP";
constexpr size_t kLengthBytes = 8;
constexpr size_t kHeadBytes = kLengthBytes + Sha256::kBytes;

std::string LittleEndian(uint64_t value) {
  std::string bytes;
  for (size_t k = 0; k < kLengthBytes; ++k) bytes += static_cast<char>(value >> (8 * k));
  return bytes;
}

uint64_t FromLittleEndian(std::string_view bytes) {
  uint64_t value = 0;
  for (size_t k = 0; k < kLengthBytes; ++k) {
    value |= uint64_t{static_cast<unsigned char>(bytes[k])} << (8 * k);
  }
  return value;
}

std::string HashOf(uint64_t record, std::string_view length, std::string_view message) {
  Sha256 hash;
  hash.Add(LittleEndian(record));
  hash.Add(length);
  hash.Add(message);
  return hash.Finish();
}

// RESOURCE_EXHAUSTED if the message would take more.
Status CheckParsedSize(const google::protobuf::Message& type, std::string_view text,
                       uint64_t most_bytes) {
  google::protobuf::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  if (ParsedSize_bytes(*type.GetDescriptor(), stream, most_bytes) <= most_bytes) {
    return Status::Ok();
  }
  return RequestTooLarge(most_bytes);
}

}  // namespace

Status SnapshotDamaged(const std::string& why) {
  return {StatusCode::kInvalidArgument, "SNAPSHOT_DAMAGED", "the snapshot is damaged: " + why};
}

SnapshotWriter::SnapshotWriter(std::function<Status(uint64_t bytes)> count)
    : count_(std::move(count)), bytes_(kMagic) {}

Status SnapshotWriter::Add(const google::protobuf::MessageLite& message) {
  if (message.ByteSizeLong() > size_t{std::numeric_limits<int>::max()}) {
    return {StatusCode::kResourceExhausted, "SNAPSHOT_TOO_LARGE",
            "one cloth or mesh takes 2 GiB or more"};
  }
  if (count_) {
    DRAPE_RETURN_IF_ERROR(count_(bytes_.size() + kHeadBytes + message.ByteSizeLong()));
  }
  const std::string text = message.SerializeAsString();
  const std::string length = LittleEndian(text.size());
  bytes_ += length;
  bytes_ += HashOf(records_++, length, text);
  bytes_ += text;
  return Status::Ok();
}

Status SnapshotReader::Begin() {
  if (!rest_.starts_with(kMagic)) {
    return SnapshotDamaged("it does not begin with " + std::string(kMagic) +
                           ", so it is no snapshot of cloths");
  }
  rest_.remove_prefix(kMagic.size());
  return Status::Ok();
}

Status SnapshotReader::Read(google::protobuf::Message& message) {
  const std::string place = "record " + std::to_string(records_);
  if (rest_.size() < kHeadBytes) return SnapshotDamaged("it ends before " + place);
  const std::string_view length = rest_.substr(0, kLengthBytes);
  const std::string_view hash = rest_.substr(kLengthBytes, Sha256::kBytes);
  const uint64_t bytes = FromLittleEndian(length);
  if (bytes > rest_.size() - kHeadBytes || bytes > uint64_t{std::numeric_limits<int>::max()}) {
    return SnapshotDamaged("it ends within " + place);
  }
  const std::string_view text = rest_.substr(kHeadBytes, bytes);
  if (HashOf(records_, length, text) != hash) {
    return SnapshotDamaged(place + " differs from what was written");
  }
  if (most_parsed_bytes_ < std::numeric_limits<uint64_t>::max() - 2 * bytes) {
    DRAPE_RETURN_IF_ERROR(CheckParsedSize(message, text, most_parsed_bytes_ + 2 * bytes));
  }
  if (!message.ParseFromArray(text.data(), static_cast<int>(text.size()))) {
    return SnapshotDamaged(place + " is no " + message.GetTypeName());
  }
  rest_.remove_prefix(kHeadBytes + bytes);
  ++records_;
  return Status::Ok();
}

Status SnapshotReader::End() const {
  if (rest_.empty()) return Status::Ok();
  return SnapshotDamaged("it goes on for " + std::to_string(rest_.size()) +
                         " bytes after its last record");
}

}  // namespace drape::api
