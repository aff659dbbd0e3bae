#include "client/examples/json_layout.h"

#include <algorithm>

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kLineWidth = 100;

// On one line, with blanks after commas and colons.
std::string OneLine(const Json& json) {
  if (!json.is_structured() || json.empty()) return json.dump();
  std::string text;
  for (const auto& [key, value] : json.items()) {
    if (!text.empty()) text += ", ";
    if (json.is_object()) text += Json(key).dump() + ": ";
    text += OneLine(value);
  }
  return json.is_object() ? "{" + text + "}" : "[" + text + "]";
}

// `first_column`: the column in which the value begins.
std::string LayOut(const Json& json, size_t indent, size_t first_column) {
  const std::string line = OneLine(json);
  if (!json.is_structured() || first_column + line.size() + 1 <= kLineWidth) return line;
  const std::string margin(indent + 1, ' ');
  const bool fills_lines = json.is_array();
  std::string text;
  std::string row;
  for (const auto& [key, value] : json.items()) {
    const std::string name = json.is_object() ? Json(key).dump() + ": " : "";
    const std::string item = name + LayOut(value, indent + 1, margin.size() + name.size());
    const bool is_new_row = !fills_lines || item.find('\n') != std::string::npos ||
                            margin.size() + row.size() + item.size() + 3 > kLineWidth;
    if (is_new_row && !row.empty()) {
      text += margin + row + ",\n";
      row.clear();
    }
    row += (row.empty() ? "" : ", ") + item;
  }
  text += margin + row + "\n" + std::string(indent, ' ');
  return json.is_object() ? "{\n" + text + "}" : "[\n" + text + "]";
}

}  // namespace

std::string LayOutJson(const Json& json) {
  return LayOut(json, 0, 0) + "\n";
}
