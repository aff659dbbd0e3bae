// JSON that people can read: short values are on one line, lists of numbers fill their lines.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

std::string LayOutJson(const nlohmann::ordered_json& json);
