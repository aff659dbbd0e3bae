// Texts of clients in messages and logs.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace drape {

// At most `max_bytes` (>= 3), cut between UTF-8 characters and ending in "..." where it was cut.
inline std::string Shortened(std::string_view text, size_t max_bytes) {
  if (text.size() <= max_bytes) return std::string(text);
  size_t end = max_bytes - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string(text.substr(0, end)) + "...";
}

}  // namespace drape
