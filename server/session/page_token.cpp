#include "server/session/page_token.h"

#include <algorithm>
#include <charconv>

namespace drape {

uint32_t EffectivePageSize(uint32_t page_size) {
  return page_size == 0 ? kDefaultPageSize : std::min(page_size, kMaxPageSize);
}

std::string MakePageToken(uint64_t last_creation_number) {
  return "after-" + std::to_string(last_creation_number);
}

Result<uint64_t> ParsePageToken(const std::string& token) {
  if (token.empty()) return uint64_t{0};
  constexpr std::string_view kPrefix = "after-";
  uint64_t number = 0;
  if (token.starts_with(kPrefix)) {
    const char* end = token.data() + token.size();
    const auto parsed = std::from_chars(token.data() + kPrefix.size(), end, number);
    if (parsed.ec == std::errc() && parsed.ptr == end && MakePageToken(number) == token) {
      return number;
    }
  }
  return Status::InvalidField("page_token", "not a token of an earlier page");
}

}  // namespace drape
