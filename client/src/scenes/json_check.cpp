#include "client/src/scenes/json_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "client/src/errors.h"

namespace drape {
inline namespace client {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using nlohmann::json;

std::string Join(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "." + name;
}

std::string Got(const json& value) {
  constexpr size_t kMaxShown = 40;
  std::string text = value.dump();
  if (text.size() > kMaxShown) text = text.substr(0, kMaxShown) + "...";
  return ", got " + text;
}

// A name without case and underscores, to recognise timeStepS as time_step_s.
std::string Folded(const std::string& name) {
  std::string folded;
  for (const char c : name) {
    if (c != '_') folded += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return folded;
}

// The fields of `type`, and more of them.
std::vector<const FieldDescriptor*> FieldsOf(const Descriptor& type,
                                             std::span<const MoreFields> more) {
  std::vector<const FieldDescriptor*> fields;
  for (int i = 0; i < type.field_count(); ++i) fields.push_back(type.field(i));
  for (const MoreFields& entry : more) {
    if (entry.type != &type) continue;
    for (int i = 0; i < entry.more->field_count(); ++i) fields.push_back(entry.more->field(i));
  }
  return fields;
}

const FieldDescriptor* FindField(std::span<const FieldDescriptor* const> fields,
                                 const std::string& name) {
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const auto* field) { return field->name() == name; });
  return found == fields.end() ? nullptr : *found;
}

Error UnknownField(std::span<const FieldDescriptor* const> fields, const std::string& path,
                   const std::string& name) {
  std::string description = "unknown field";
  std::string known;
  for (const FieldDescriptor* field : fields) {
    if (Folded(field->name()) == Folded(name)) {
      return BadField(Join(path, name), description + "; did you mean " + field->name() + "?");
    }
    known += (known.empty() ? " " : ", ") + field->name();
  }
  return BadField(Join(path, name), description + "; known here:" + known);
}

void CheckWholeNumber(const json& value, double highest, const std::string& path) {
  const double number = value.is_number() ? value.get<double>() : -1;
  if (number < 0 || number > highest || number != std::floor(number)) {
    std::string top = highest > 1e15 ? "2^64-1" : std::to_string(static_cast<uint64_t>(highest));
    throw BadField(path, "must be a whole number from 0 to " + top + Got(value));
  }
}

void CheckEnum(const json& value, const google::protobuf::EnumDescriptor& type,
               const std::string& path) {
  if (value.is_string() && type.FindValueByName(value.get<std::string>()) != nullptr) return;
  std::string names;
  for (int i = 0; i < type.value_count(); ++i) {
    if (type.value(i)->number() == 0) continue;  // *_UNSPECIFIED is said by leaving the field out
    names += (names.empty() ? "" : ", ") + type.value(i)->name();
  }
  throw BadField(path, "must be one of " + names + Got(value));
}

void CheckValue(const json& value, const FieldDescriptor& field, const std::string& path,
                std::span<const MoreFields> more) {
  if (value.is_array()) {
    throw BadField(path, field.is_repeated()
                             ? "a list inside a list; lists of vectors are flat" + Got(value)
                             : "must be a single value" + Got(value));
  }
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return CheckJson(value, *field.message_type(), path, more);
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      if (value.is_number() || value == "NaN" || value == "Infinity" || value == "-Infinity")
        return;
      throw BadField(path, "must be a number" + Got(value));
    case FieldDescriptor::CPPTYPE_UINT32:
      return CheckWholeNumber(value, std::numeric_limits<uint32_t>::max(), path);
    case FieldDescriptor::CPPTYPE_UINT64:
      return CheckWholeNumber(value, 18446744073709549568.0, path);  // largest double below 2^64
    case FieldDescriptor::CPPTYPE_ENUM:
      return CheckEnum(value, *field.enum_type(), path);
    case FieldDescriptor::CPPTYPE_BOOL:
      if (value.is_boolean()) return;
      throw BadField(path, "must be true or false" + Got(value));
    default:  // strings and bytes
      if (value.is_string()) return;
      throw BadField(path, "must be a string" + Got(value));
  }
}

void CheckField(const json& value, const FieldDescriptor& field, const std::string& path,
                std::span<const MoreFields> more) {
  if (!field.is_repeated()) return CheckValue(value, field, path, more);
  if (!value.is_array()) throw BadField(path, "must be a list" + Got(value));
  for (size_t i = 0; i < value.size(); ++i) {
    CheckValue(value[i], field, path + "[" + std::to_string(i) + "]", more);
  }
}

}  // namespace

json ParseJson(std::string_view text) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto refuse_repeated_keys = [&keys](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key &&
        !keys.back().insert(parsed.get<std::string>()).second) {
      throw BadField(parsed.get<std::string>(), "is given twice in one object");
    }
    return true;
  };
  try {
    return json::parse(text, refuse_repeated_keys);
  } catch (const json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 1, ...": the name is the library's.
    const std::string reason = error.what();
    const size_t name_end = reason.starts_with('[') ? reason.find("] ") : std::string::npos;
    throw LocalError(ErrorCode::kInvalidArgument, "BAD_JSON",
                     name_end == std::string::npos ? reason : reason.substr(name_end + 2));
  }
}

void CheckJson(const json& value, const Descriptor& type, const std::string& path,
               std::span<const MoreFields> more) {
  if (value.is_null()) return;
  if (!value.is_object()) {
    throw BadField(path.empty() ? type.name() : path, "must be an object" + Got(value));
  }
  const std::vector<const FieldDescriptor*> fields = FieldsOf(type, more);
  std::vector<const FieldDescriptor*> member_of(static_cast<size_t>(type.oneof_decl_count()));
  for (const auto& [name, member] : value.items()) {
    const FieldDescriptor* field = FindField(fields, name);
    if (field == nullptr) throw UnknownField(fields, path, name);
    if (member.is_null()) continue;
    CheckField(member, *field, Join(path, name), more);
    const auto* oneof = field->real_containing_oneof();
    if (oneof == nullptr) continue;
    const FieldDescriptor*& other = member_of[static_cast<size_t>(oneof->index())];
    if (other != nullptr) {
      throw BadField(Join(path, name),
                     "only one of " + other->name() + " and " + name + " may be given");
    }
    other = field;
  }
}

}  // namespace client
}  // namespace drape
