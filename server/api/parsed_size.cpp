#include "server/api/parsed_size.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <limits>
#include <string>

namespace drape::api {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// Of the allocator, of the list that points to it, which grows by doubling, and of the place for
// fields that its type does not know.
constexpr uint64_t kPerObject_bytes = 96;
// google::protobuf::UnknownField, in a list that grows by doubling, and its set or string.
constexpr uint64_t kPerUnknownField_bytes = 96;
// The first room of a list, and how far it may be ahead of what is in it: it doubles.
constexpr uint64_t kPerList_bytes = 96, kGrowth = 2;
// As deep as the parser of protobuf goes.
constexpr int kMaxDepth = 100;

class Walk {
 public:
  Walk(CodedInputStream& in, uint64_t enough_bytes) : in_(in), enough_bytes_(enough_bytes) {}

  // Of a message up to the end of the input or of the limit that is set. False: no message, or
  // enough.
  bool Message(const Descriptor& type, int depth) {
    const auto* prototype =
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
    size_bytes_ += kPerObject_bytes + prototype->SpaceUsedLong();
    uint64_t lists = 0;
    while (size_bytes_ <= enough_bytes_) {
      const uint32_t tag = in_.ReadTag();
      if (tag == 0) return in_.ConsumedEntireMessage();
      if (!Field(type, tag, depth, lists)) return false;
    }
    return false;
  }

  uint64_t size_bytes() const { return size_bytes_; }

 private:
  // `lists`: of the repeated fields that the message had so far, one bit each.
  bool Field(const Descriptor& type, uint32_t tag, int depth, uint64_t& lists) {
    const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    // A number that comes in the form of another type is kept as an unknown field, too.
    if (field != nullptr && !MayHave(*field, wire_type)) field = nullptr;
    if (field != nullptr && field->is_repeated()) BeginList(*field, lists);
    if (wire_type != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      if (field == nullptr) {
        size_bytes_ += kPerUnknownField_bytes;
      } else if (field->is_repeated()) {
        size_bytes_ += kGrowth * sizeof(uint64_t);
      }
      return Skip(tag);
    }
    uint32_t length = 0;
    if (!in_.ReadVarint32(&length)) return false;
    if (field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      return depth < kMaxDepth && SubMessage(*field->message_type(), length, depth);
    }
    size_bytes_ += field == nullptr ? kPerUnknownField_bytes + length : BytesOf(*field, length);
    return in_.Skip(static_cast<int>(std::min<uint32_t>(length, std::numeric_limits<int>::max())));
  }

  static bool MayHave(const FieldDescriptor& field, WireFormatLite::WireType wire_type) {
    const auto type = static_cast<WireFormatLite::FieldType>(field.type());
    return wire_type == WireFormatLite::WireTypeForFieldType(type) ||
           (field.is_packable() && wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  }

  void BeginList(const FieldDescriptor& field, uint64_t& lists) {
    const uint64_t bit = uint64_t{1} << std::min(field.index(), 63);
    if ((lists & bit) == 0 || field.index() >= 63) size_bytes_ += kPerList_bytes;
    lists |= bit;
  }

  bool SubMessage(const Descriptor& type, uint32_t length, int depth) {
    if (length > static_cast<uint32_t>(std::numeric_limits<int>::max())) return false;
    const CodedInputStream::Limit limit = in_.PushLimit(static_cast<int>(length));
    const bool is_whole = Message(type, depth + 1) && in_.BytesUntilLimit() == 0;
    in_.PopLimit(limit);
    return is_whole;
  }

  // Of strings, and of numbers that are packed: one byte of the wire may be a whole number.
  static uint64_t BytesOf(const FieldDescriptor& field, uint64_t length) {
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
      return kPerObject_bytes + sizeof(std::string) + length;
    }
    return length * BytesPerWireByte(field);
  }
  static uint64_t BytesPerWireByte(const FieldDescriptor& field) {
    switch (field.type()) {
      case FieldDescriptor::TYPE_DOUBLE:
      case FieldDescriptor::TYPE_FLOAT:
      case FieldDescriptor::TYPE_FIXED32:
      case FieldDescriptor::TYPE_FIXED64:
      case FieldDescriptor::TYPE_SFIXED32:
      case FieldDescriptor::TYPE_SFIXED64:
        return 1;  // their count is known before there is room for them
      case FieldDescriptor::TYPE_BOOL:
        return kGrowth;
      default:
        return kGrowth * sizeof(uint64_t);
    }
  }

  static bool IsGroup(uint32_t tag) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    return wire_type == WireFormatLite::WIRETYPE_START_GROUP ||
           wire_type == WireFormatLite::WIRETYPE_END_GROUP;
  }

  // The value of a field that is not delimited by a length. Groups only begin and end here; what is
  // in them counts as fields.
  bool Skip(uint32_t tag) { return IsGroup(tag) || WireFormatLite::SkipField(&in_, tag); }

  CodedInputStream& in_;
  const uint64_t enough_bytes_;
  uint64_t size_bytes_ = 0;
};

}  // namespace

uint64_t ParsedSize_bytes(const Descriptor& type, google::protobuf::io::ZeroCopyInputStream& bytes,
                          uint64_t enough_bytes) {
  CodedInputStream in(&bytes);
  in.SetTotalBytesLimit(std::numeric_limits<int>::max());
  Walk walk(in, enough_bytes);
  walk.Message(type, 0);
  return walk.size_bytes();
}

Status RequestTooLarge(uint64_t most_bytes) {
  return {StatusCode::kResourceExhausted, "REQUEST_TOO_LARGE",
          "the request takes more than " + std::to_string(most_bytes) +
              " bytes of memory once it is parsed: it has too many parts"};
}

}  // namespace drape::api
