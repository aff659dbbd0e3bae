#include "server/core/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

namespace drape {
namespace {

constexpr std::array<const char*, 6> kLevels = {"trace", "debug", "info", "warn", "error", "off"};
// Random digits of a session's name, and how many of them are shown.
constexpr size_t kNameDigits = 32;
constexpr size_t kShownDigits = 4;

bool IsHexDigit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

bool IsIdCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
}

bool IsControl(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

std::string WithoutControls(std::string_view text) {
  std::string clean;
  clean.reserve(text.size());
  for (const char c : text) {
    if (!IsControl(c)) {
      clean += c;
      continue;
    }
    constexpr char kDigits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    clean += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return clean;
}

// Where a quoted text that begins after `begin` ends: at a quote before the next pair or the end.
size_t EndOfQuoted(std::string_view line, size_t begin) {
  for (size_t k = begin; k < line.size(); ++k) {
    if (line[k] == '\\') {
      ++k;
    } else if (line[k] == '"' && (k + 1 == line.size() || line[k + 1] == ' ')) {
      return k;
    }
  }
  return line.size();
}

std::string Unescaped(std::string_view text) {
  std::string plain;
  for (size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '\\' && k + 1 < text.size() && (text[k + 1] == '"' || text[k + 1] == '\\')) ++k;
    plain += text[k];
  }
  return plain;
}

// Numbers and truth values as such.
nlohmann::ordered_json ValueOf(std::string_view bare) {
  const bool begins_as_value =
      !bare.empty() && (std::isdigit(static_cast<unsigned char>(bare[0])) || bare[0] == '-' ||
                        bare[0] == 't' || bare[0] == 'f');
  if (begins_as_value) {
    auto value = nlohmann::ordered_json::parse(bare, nullptr, /*allow_exceptions=*/false);
    if (value.is_number() || value.is_boolean()) return value;
  }
  return std::string(bare);
}

bool IsKey(std::string_view word) {
  return !word.empty() &&
         std::all_of(word.begin(), word.end(), [](char c) { return c == '_' || IsIdCharacter(c); });
}

// Takes one word or pair from the front of the line.
void TakePart(std::string_view& line, nlohmann::ordered_json& object, std::string& rest) {
  const size_t equals = line.find('=');
  const size_t space = std::min(line.find(' '), line.size());
  if (equals >= space || !IsKey(line.substr(0, equals))) {
    rest += (rest.empty() ? "" : " ") + std::string(line.substr(0, space));
    line.remove_prefix(std::min(space + 1, line.size()));
    return;
  }
  std::string key(line.substr(0, equals));
  if (key == "time" || key == "level" || key == "event") key.insert(0, "event_");  // of the line
  line.remove_prefix(equals + 1);
  size_t end = 0;
  if (line.starts_with('"')) {
    end = EndOfQuoted(line, 1);
    object[key] = Unescaped(line.substr(1, end - 1));
    ++end;
  } else {
    end = std::min(line.find(' '), line.size());
    object[key] = ValueOf(line.substr(0, end));
  }
  line.remove_prefix(std::min(end + 1, line.size()));
}

// %v of our patterns.
class Payload final : public spdlog::custom_flag_formatter {
 public:
  explicit Payload(LogFormat format) : format_(format) {}

  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    std::string line =
        WithoutControls(WithoutSessionNames({message.payload.data(), message.payload.size()}));
    if (format_ == LogFormat::kJson) line = LineAsJson(line);
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<Payload>(format_);
  }

 private:
  const LogFormat format_;
};

Status CheckLevel(const std::string& field, const std::string& level) {
  if (std::find(kLevels.begin(), kLevels.end(), level) != kLevels.end()) return Status::Ok();
  return Status::InvalidField(field,
                              "'" + level + "' is not one of trace, debug, info, warn, error, off");
}

spdlog::level::level_enum LevelOf(const std::string& level) {
  return spdlog::level::from_str(level);
}

}  // namespace

std::string WithoutSessionNames(std::string_view text) {
  std::string shown;
  for (size_t k = 0; k < text.size();) {
    // Behind "-" and an id in a name; alone where a client wrote them so.
    size_t digits = 0;
    while (k + digits < text.size() && IsHexDigit(text[k + digits])) ++digits;
    if (digits < kNameDigits) {
      const size_t plain = std::max<size_t>(digits, 1);
      shown += text.substr(k, plain);
      k += plain;
      continue;
    }
    shown += std::string(text.substr(k, kShownDigits)) + "...";
    k += digits;
  }
  return shown;
}

std::string LogText(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::string LineAsJson(std::string_view line) {
  nlohmann::ordered_json object;
  std::string rest;
  const size_t space = std::min(line.find(' '), line.size());
  object["event"] = std::string(line.substr(0, space));
  line.remove_prefix(std::min(space + 1, line.size()));
  while (!line.empty()) TakePart(line, object, rest);
  if (!rest.empty()) object["text"] = rest;
  const std::string text =
      object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  return text.substr(1, text.size() - 2);
}

Status InitLog(const std::string& level, LogFormat format) {
  DRAPE_RETURN_IF_ERROR(CheckLevel("log-level", level));
  auto logger = spdlog::stderr_color_mt("draped");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<Payload>('v', format);
  formatter->set_pattern(format == LogFormat::kText
                             ? "%Y-%m-%dT%H:%M:%S.%e %^%l%$ %v"
                             : R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%v})");
  logger->set_formatter(std::move(formatter));
  logger->set_level(LevelOf(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  return Status::Ok();
}

Status SetLogLevel(const std::string& level) {
  DRAPE_RETURN_IF_ERROR(CheckLevel("level", level));
  spdlog::default_logger_raw()->set_level(LevelOf(level));
  return Status::Ok();
}

std::string LogLevel() {
  const auto level = spdlog::default_logger_raw()->level();
  for (const char* name : kLevels) {
    if (LevelOf(name) == level) return name;
  }
  return "critical";
}

}  // namespace drape
