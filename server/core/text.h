// Texts of clients in messages and logs; bytes as digits.
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

// Two lower-case hexadecimal digits per byte.
inline std::string HexOf(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string digits;
  for (const char byte : bytes) {
    const auto bits = static_cast<unsigned char>(byte);
    digits += {kDigits[bits >> 4], kDigits[bits & 15]};
  }
  return digits;
}

}  // namespace drape
