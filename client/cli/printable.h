// Texts that others wrote, for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace drape::cli {

// With control characters, and those that turn the direction of what follows, as \xNN: they could
// move the cursor, or write what looks like ours.
std::string Printable(std::string_view text);

}  // namespace drape::cli
