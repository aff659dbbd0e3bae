// Structured log lines on stderr: time, level, event word, key=value pairs.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

#include "server/core/status.h"

namespace drape {

// `level`: trace, debug, info, warn, error or off. Call once, before any thread starts.
Status InitLog(const std::string& level);

}  // namespace drape
