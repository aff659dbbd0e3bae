#include "tests/fuzz/targets/message_mutator.h"

#include <google/protobuf/descriptor.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>

#include "tests/fuzz/targets/byte_mutator.h"

namespace drape::test {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr std::array kDoubles = {0.0,
                                 -0.0,
                                 1.0,
                                 -1.0,
                                 0.5,
                                 2.0,
                                 1e-12,
                                 1e-300,
                                 5e-324,
                                 1e6,
                                 1e9,
                                 1e15,
                                 1e30,
                                 1e300,
                                 -1e6,
                                 0.1,
                                 3.0,
                                 1.0000001,
                                 std::numeric_limits<double>::infinity(),
                                 std::numeric_limits<double>::quiet_NaN()};
constexpr std::array<uint64_t, 16> kWholes = {
    0,    1,    2,     3,     7,          16,         17,         255,
    4096, 4097, 65535, 65536, 0x7fffffff, 0x80000000, 0xffffffff, 0xffffffffffffffff};

class MessageMutator {
 public:
  explicit MessageMutator(uint32_t seed) : bytes_(seed) {}

  void Change(Message& message, int depth = 0) {
    const auto* type = message.GetDescriptor();
    if (type->field_count() == 0) return;
    const Reflection& reflection = *message.GetReflection();
    std::vector<const FieldDescriptor*> present;
    reflection.ListFields(message, &present);
    // Mostly of what is there, sometimes something new.
    const bool is_new = present.empty() || Below(4) == 0;
    const FieldDescriptor* field =
        is_new ? type->field(static_cast<int>(Below(static_cast<size_t>(type->field_count()))))
               : present[Below(present.size())];
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (!is_new && Below(is_message ? 16 : 8) == 0) {
      reflection.ClearField(&message, field);
    } else if (field->is_map()) {
      reflection.ClearField(&message, field);
    } else if (field->is_repeated()) {
      ChangeList(message, *field, depth);
    } else if (is_message) {
      Message* part = reflection.MutableMessage(&message, field);
      if (depth < kDepth) Change(*part, depth + 1);
    } else {
      SetOne(message, *field);
    }
  }
  size_t Below(size_t bound) { return bytes_.Below(bound); }

 private:
  static constexpr int kDepth = 12;
  static constexpr int kMaxRepeated = 64;

  double Real(double old) {
    switch (Below(4)) {
      case 0:
        return old * (Below(2) == 0 ? 2 : 0.5);
      case 1:
        return -old;
      default:
        return kDoubles[Below(kDoubles.size())];
    }
  }
  uint64_t Whole(uint64_t old) {
    switch (Below(4)) {
      case 0:
        return old + 1;
      case 1:
        return old - 1;
      default:
        return kWholes[Below(kWholes.size())];
    }
  }
  // Sometimes of a length that is a multiple of 4, as packed arrays are.
  std::string Text(std::string old) {
    if (old.size() < 4 || Below(2) == 0) return bytes_.Mutate(old.empty() ? "x" : old);
    const auto number = static_cast<float>(kDoubles[Below(kDoubles.size())]);
    std::memcpy(&old[4 * Below(old.size() / 4)], &number, sizeof(number));
    return old;
  }

  void SetOne(Message& message, const FieldDescriptor& field) {
    const Reflection& r = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return r.SetDouble(&message, &field, Real(r.GetDouble(message, &field)));
      case FieldDescriptor::CPPTYPE_FLOAT:
        return r.SetFloat(&message, &field,
                          static_cast<float>(Real(double{r.GetFloat(message, &field)})));
      case FieldDescriptor::CPPTYPE_UINT32:
        return r.SetUInt32(&message, &field,
                           static_cast<uint32_t>(Whole(r.GetUInt32(message, &field))));
      case FieldDescriptor::CPPTYPE_UINT64:
        return r.SetUInt64(&message, &field, Whole(r.GetUInt64(message, &field)));
      case FieldDescriptor::CPPTYPE_INT32:
        return r.SetInt32(
            &message, &field,
            static_cast<int32_t>(Whole(static_cast<uint64_t>(r.GetInt32(message, &field)))));
      case FieldDescriptor::CPPTYPE_INT64:
        return r.SetInt64(
            &message, &field,
            static_cast<int64_t>(Whole(static_cast<uint64_t>(r.GetInt64(message, &field)))));
      case FieldDescriptor::CPPTYPE_BOOL:
        return r.SetBool(&message, &field, Below(2) == 0);
      case FieldDescriptor::CPPTYPE_ENUM:
        return r.SetEnumValue(&message, &field, static_cast<int>(Below(9)));
      case FieldDescriptor::CPPTYPE_STRING: {
        const std::string old = r.GetString(message, &field);
        return r.SetString(&message, &field, Text(old));
      }
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return;
    }
  }

  void ChangeList(Message& message, const FieldDescriptor& field, int depth) {
    const Reflection& r = *message.GetReflection();
    const int size = r.FieldSize(message, &field);
    const auto any = [&] { return static_cast<int>(Below(static_cast<size_t>(size))); };
    const size_t kind = Below(8);
    if (size > 0 && kind == 0) return r.RemoveLast(&message, &field);
    if (size > 1 && kind == 1) return r.SwapElements(&message, &field, any(), any());
    if (size > 0 && (kind > 3 || size >= kMaxRepeated))
      return ChangeElement(message, field, any(), depth);
    AddElement(message, field, size > 0 ? any() : -1);
  }

  void ChangeElement(Message& message, const FieldDescriptor& field, int at, int depth) {
    const Reflection& r = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return r.SetRepeatedDouble(&message, &field, at,
                                   Real(r.GetRepeatedDouble(message, &field, at)));
      case FieldDescriptor::CPPTYPE_UINT32:
        return r.SetRepeatedUInt32(
            &message, &field, at,
            static_cast<uint32_t>(Whole(r.GetRepeatedUInt32(message, &field, at))));
      case FieldDescriptor::CPPTYPE_UINT64:
        return r.SetRepeatedUInt64(&message, &field, at,
                                   Whole(r.GetRepeatedUInt64(message, &field, at)));
      case FieldDescriptor::CPPTYPE_INT32:
        return r.SetRepeatedInt32(&message, &field, at,
                                  static_cast<int32_t>(Whole(static_cast<uint64_t>(
                                      r.GetRepeatedInt32(message, &field, at)))));
      case FieldDescriptor::CPPTYPE_ENUM:
        return r.SetRepeatedEnumValue(&message, &field, at, static_cast<int>(Below(9)));
      case FieldDescriptor::CPPTYPE_STRING: {
        const std::string old = r.GetRepeatedString(message, &field, at);
        return r.SetRepeatedString(&message, &field, at, Text(old));
      }
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kDepth) Change(*r.MutableRepeatedMessage(&message, &field, at), depth + 1);
        return;
      default:
        return;
    }
  }

  // A copy of element `like`; -1: an empty one.
  void AddElement(Message& message, const FieldDescriptor& field, int like) {
    const Reflection& r = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return r.AddDouble(&message, &field,
                           like < 0 ? 1 : r.GetRepeatedDouble(message, &field, like));
      case FieldDescriptor::CPPTYPE_UINT32:
        return r.AddUInt32(&message, &field,
                           like < 0 ? 1 : r.GetRepeatedUInt32(message, &field, like));
      case FieldDescriptor::CPPTYPE_UINT64:
        return r.AddUInt64(&message, &field,
                           like < 0 ? 1 : r.GetRepeatedUInt64(message, &field, like));
      case FieldDescriptor::CPPTYPE_INT32:
        return r.AddInt32(&message, &field,
                          like < 0 ? 1 : r.GetRepeatedInt32(message, &field, like));
      case FieldDescriptor::CPPTYPE_ENUM:
        return r.AddEnumValue(&message, &field, static_cast<int>(Below(9)));
      case FieldDescriptor::CPPTYPE_STRING:
        return r.AddString(&message, &field,
                           like < 0 ? "x" : r.GetRepeatedString(message, &field, like));
      case FieldDescriptor::CPPTYPE_MESSAGE: {
        Message* added = r.AddMessage(&message, &field);
        if (like >= 0) added->CopyFrom(r.GetRepeatedMessage(message, &field, like));
        return;
      }
      default:
        return;
    }
  }

  ByteMutator bytes_;
};

}  // namespace

void MutateMessage(Message& message, uint32_t seed) {
  MessageMutator mutator(seed);
  for (size_t changes = 1 + mutator.Below(4); changes > 0; --changes) mutator.Change(message);
}

}  // namespace drape::test
