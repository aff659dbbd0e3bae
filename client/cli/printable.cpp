#include "client/cli/printable.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>

namespace drape::cli {
namespace {

// Bytes of the control character that `text` begins with in UTF-8; 0: it begins with another one.
size_t ControlBytes(std::string_view text) {
  const auto byte = [text](size_t k) -> unsigned {
    return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u;
  };
  const auto is_within = [&byte](size_t k, unsigned first, unsigned last) {
    return byte(k) >= first && byte(k) <= last;
  };
  if (byte(0) < 0x20 || byte(0) == 0x7F) return 1;
  if (byte(0) == 0xC2 && is_within(1, 0x80, 0x9F)) return 2;  // C1
  if (byte(0) == 0xD8 && byte(1) == 0x9C) return 2;           // U+061C, Arabic letter mark
  if (byte(0) != 0xE2) return 0;
  // U+200E and 200F, the marks; U+2028 to 202E, ends of lines, embeddings and overrides; U+2066 to
  // 2069, isolates.
  const bool turns = byte(1) == 0x80 && (is_within(2, 0x8E, 0x8F) || is_within(2, 0xA8, 0xAE));
  return turns || (byte(1) == 0x81 && is_within(2, 0xA6, 0xA9)) ? 3 : 0;
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string printable;
  while (!text.empty()) {
    const size_t count = ControlBytes(text);
    if (count == 0) printable += text[0];
    for (const char byte : text.substr(0, count)) {
      char escaped[5];
      std::snprintf(escaped, sizeof(escaped), "\\x%02X", static_cast<unsigned char>(byte));
      printable += escaped;
    }
    text.remove_prefix(std::max<size_t>(1, count));
  }
  return printable;
}

}  // namespace drape::cli
