#include "server/core/memory_size.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace drape {
namespace {

namespace fs = std::filesystem;

// UINT64_MAX where there is no file, or no number in it ("max").
uint64_t NumberIn(const fs::path& file) {
  std::ifstream text(file);
  uint64_t number = 0;
  return text >> number ? number : UINT64_MAX;
}

// Of the group and of all above it.
uint64_t LeastAlong(const fs::path& root, fs::path group, const std::string& file) {
  uint64_t least = NumberIn(root / file);
  for (; group.has_relative_path(); group = group.parent_path()) {
    least = std::min(least, NumberIn(root / group.relative_path() / file));
  }
  return least;
}

uint64_t LimitOf(__rlimit_resource resource) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return UINT64_MAX;
  return limit.rlim_cur;
}

}  // namespace

uint64_t ControlGroupMemory_bytes(const std::string& membership, const std::string& root) {
  uint64_t least = UINT64_MAX;
  std::istringstream lines(membership);
  // "0::/path" of version 2, "9:cpu,memory:/path" of version 1.
  for (std::string line; std::getline(lines, line);) {
    const size_t controllers = line.find(':'), path = line.find(':', controllers + 1);
    if (controllers == std::string::npos || path == std::string::npos) continue;
    const std::string names = "," + line.substr(controllers + 1, path - controllers - 1) + ",";
    const fs::path group = line.substr(path + 1);
    if (names == ",,") least = std::min(least, LeastAlong(root, group, "memory.max"));
    if (names.find(",memory,") != std::string::npos) {
      least =
          std::min(least, LeastAlong(fs::path(root) / "memory", group, "memory.limit_in_bytes"));
    }
  }
  return least;
}

uint64_t MemoryOfProcess_bytes() {
  const auto pages = static_cast<uint64_t>(std::max<long>(1, sysconf(_SC_PHYS_PAGES)));
  std::ifstream file("/proc/self/cgroup");
  const std::string membership{std::istreambuf_iterator<char>(file), {}};
  return std::max<uint64_t>(1, std::min({pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)),
                                         ControlGroupMemory_bytes(membership, "/sys/fs/cgroup"),
                                         LimitOf(RLIMIT_DATA), LimitOf(RLIMIT_AS)}));
}

}  // namespace drape
