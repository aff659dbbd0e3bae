// Structured log lines on stderr: time, level, event word, key=value pairs; or the same as JSON.
#pragma once

#include <spdlog/spdlog.h>

#include <string>
#include <string_view>

#include "server/core/status.h"

namespace drape {

enum class LogFormat {
  kText,  // 2026-03-01T12:00:00.000 info session_created name=sessions/a-0123... ttl_s=300
  kJson,  // {"time":"2026-03-01T12:00:00.000+01:00","level":"info","event":"session_created", ...}
};

// `level`: trace, debug, info, warn, error or off. Call once, before any thread starts.
//
// Lines are written as `spdlog::info("event_word key={} key=\"{}\"", ...)`; texts that others wrote
// go through LogText. Whatever is in a line, names of sessions are shortened in it, since a name
// gives access, and control characters are escaped.
Status InitLog(const std::string& level, LogFormat format = LogFormat::kText);

// From now on. Any thread; INVALID_ARGUMENT naming "level".
Status SetLogLevel(const std::string& level);
std::string LogLevel();

// In quotes, with what would end them escaped.
std::string LogText(std::string_view text);

// --- For tests.
// Names of sessions, in full, without "sessions/", or their 32 random digits alone, with 4 of
// these.
std::string WithoutSessionNames(std::string_view text);
// The members of a line as a JSON object, without braces; "event" first. Pure.
std::string LineAsJson(std::string_view line);

}  // namespace drape
