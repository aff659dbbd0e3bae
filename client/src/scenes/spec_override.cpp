#include "client/src/scenes/spec_override.h"

#include <charconv>
#include <vector>

#include "client/src/errors.h"

namespace drape {
inline namespace client {
namespace {

using nlohmann::json;

std::vector<std::string> Split(const std::string& path) {
  std::vector<std::string> names;
  size_t begin = 0;
  while (true) {
    const size_t end = path.find('.', begin);
    names.push_back(path.substr(begin, end - begin));
    if (end == std::string::npos) return names;
    begin = end + 1;
  }
}

// The member `name` of `parent`, made if it does not exist.
json& Member(json& parent, const std::string& name, const std::string& path) {
  if (parent.is_null()) parent = json::object();
  if (parent.is_object()) return parent[name];
  if (!parent.is_array()) throw BadField(path, "cannot be set: its parent has no members");
  size_t index = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
  if (error != std::errc() || end != name.data() + name.size() || index > parent.size()) {
    throw BadField(path, "cannot be set: \"" + name + "\" is not an index of a list of " +
                             std::to_string(parent.size()));
  }
  if (index == parent.size()) parent.push_back(nullptr);
  return parent[index];
}

// JSON strings can hold nothing else.
bool IsUtf8(const std::string& text) {
  try {
    (void)json(text).dump();
    return true;
  } catch (const json::type_error&) {
    return false;
  }
}

}  // namespace

SpecOverride ParseOverride(const std::string& text) {
  if (!IsUtf8(text)) {
    throw LocalError(ErrorCode::kInvalidArgument, "BAD_OVERRIDE", "PATH=VALUE is not UTF-8 text");
  }
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos) {
    throw LocalError(ErrorCode::kInvalidArgument, "BAD_OVERRIDE",
                     "\"" + text + "\" is not PATH=VALUE");
  }
  SpecOverride override;
  override.path = text.substr(0, equals);
  for (const std::string& name : Split(override.path)) {
    if (name.empty()) {
      throw LocalError(ErrorCode::kInvalidArgument, "BAD_OVERRIDE",
                       "\"" + override.path + "\" has an empty name in its path");
    }
  }
  const std::string value = text.substr(equals + 1);
  override.value = json::parse(value, nullptr, /*allow_exceptions=*/false);
  if (override.value.is_discarded()) override.value = value;
  return override;
}

void ApplyOverride(const SpecOverride& override, json* spec) {
  json* place = spec;
  for (const std::string& name : Split(override.path)) {
    place = &Member(*place, name, override.path);
  }
  *place = override.value;
}

}  // namespace client
}  // namespace drape
