// The driver's messages as log lines.
#pragma once

namespace drape::gl {

// Sends the messages of the current context to spdlog: errors as error, hints on speed as debug.
void EnableDebugLog();

}  // namespace drape::gl
