// The configuration file of draped.
#pragma once

#include <CLI/CLI.hpp>
#include <istream>
#include <string>
#include <vector>

namespace drape {

// Reads a configuration in one of three forms, told apart by their first sign:
// - protobuf text of the message `ServerConfig`: max_sessions: 10
// - lines name=value, as CLI11 has them:         max-sessions=10
// - a JSON object:                               {"max-sessions": 10}
// The options of the app are the only list of names: ServerConfig has a field for each, of its
// type, with underscores for hyphens. A name that is none of them is an error.
class ConfigFile final : public CLI::ConfigBase {
 public:
  // app outlives this.
  explicit ConfigFile(const CLI::App& app) : app_(app) {}

  // Throws CLI::FileError with line and column of what is wrong.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  const CLI::App& app_;
};

// What the app has parsed, defaults included, as protobuf text that from_config reads, each value
// below its meaning. What has no value is a comment.
std::string ConfigAsText(const CLI::App& app);

}  // namespace drape
