// --set path=value
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace drape {
inline namespace client {

// One "path=value": names joined by dots, indices of lists as numbers.
struct SpecOverride {
  std::string path;
  nlohmann::json value;
};

// The value is JSON, or else a string. Throws kInvalidArgument without "=" or with an empty name.
SpecOverride ParseOverride(const std::string& text);

// Puts the value at the path, making objects on the way. A list grows by at most one. Throws
// BadField when the path leads through a value that has no members.
void ApplyOverride(const SpecOverride& override, nlohmann::json* spec);

}  // namespace client
}  // namespace drape
