// Numbers for sessions, as lists that are indexed by them need.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

namespace drape {

// Numbers the sessions that have requests, densely: a number is used again when its session has no
// more requests.
class SessionIndex {
 public:
  uint32_t Enter(const std::string& session);
  void Leave(const std::string& session);

 private:
  struct Entry {
    uint32_t index = 0;
    uint32_t requests = 0;
  };
  std::unordered_map<std::string, Entry> entries_;
  std::vector<uint32_t> free_;
};

}  // namespace drape
