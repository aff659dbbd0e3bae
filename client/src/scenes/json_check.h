// Finds the errors of a JSON text before protobuf's parser, whose messages name neither the whole
// path nor the legal values.
#pragma once

#include <google/protobuf/descriptor.h>

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace drape {
inline namespace client {

// Strict JSON: no comments, no trailing commas, no repeated keys. Throws kInvalidArgument with line
// and column, or the repeated key.
nlohmann::json ParseJson(std::string_view text);

// In the text an object of `type` may have the fields of `more` besides its own.
struct MoreFields {
  const google::protobuf::Descriptor* type;
  const google::protobuf::Descriptor* more;
};

// Checks `json` against the fields of `type` with their snake_case names: unknown fields, kinds of
// values, lists inside lists, ranges of whole numbers, names of enum values, more than one member
// of a oneof. Throws BadField with the path from `path` on. null stands for "not set".
void CheckJson(const nlohmann::json& json, const google::protobuf::Descriptor& type,
               const std::string& path, std::span<const MoreFields> more = {});

}  // namespace client
}  // namespace drape
