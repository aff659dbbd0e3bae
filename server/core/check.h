// Programmer errors: abort with a message. Never reachable by client input.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace drape {

[[noreturn]] inline void CheckFailed(const char* file, int line, const char* condition,
                                     std::string_view message) {
  std::fprintf(stderr, "%s:%d: check failed: %s: %.*s\n", file, line, condition,
               static_cast<int>(message.size()), message.data());
  std::abort();
}

}  // namespace drape

#define DRAPE_CHECK(condition, message)                                              \
  do {                                                                               \
    if (!(condition)) ::drape::CheckFailed(__FILE__, __LINE__, #condition, message); \
  } while (false)
