#include "client/cli/printable.h"

#include <cstdio>

namespace drape::cli {
namespace {

// C0, DEL, and C1, which UTF-8 writes as C2 80 to C2 9F.
bool IsControl(std::string_view text, size_t k) {
  const auto byte = static_cast<unsigned char>(text[k]);
  if (byte < 0x20 || byte == 0x7F) return true;
  const auto before = k > 0 ? static_cast<unsigned char>(text[k - 1]) : 0u;
  const auto after = k + 1 < text.size() ? static_cast<unsigned char>(text[k + 1]) : 0u;
  const auto is_c1 = [](unsigned lead, unsigned next) {
    return lead == 0xC2 && next >= 0x80 && next < 0xA0;
  };
  return is_c1(before, byte) || is_c1(byte, after);
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string printable;
  for (size_t k = 0; k < text.size(); ++k) {
    if (!IsControl(text, k)) {
      printable += text[k];
      continue;
    }
    char escaped[5];
    std::snprintf(escaped, sizeof(escaped), "\\x%02X", static_cast<unsigned char>(text[k]));
    printable += escaped;
  }
  return printable;
}

}  // namespace drape::cli
