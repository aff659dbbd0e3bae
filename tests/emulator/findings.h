// What the emulator finds wrong with a kernel.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace drape::emulator {

enum class Fault : uint8_t {
  kRace,          // two accesses of one word that no barrier orders
  kNotVisible,    // a barrier, but no memory barrier or a block that is not coherent
  kUnwritten,     // reads what nothing has written
  kOutOfBounds,   // of an array or a block
  kBarrier,       // in control flow that is not uniform
  kInactiveLane,  // a shuffle from an invocation that does not take part
  kReadonly,      // writes to a block that it only reads
};
const char* NameOf(Fault fault);

// Places are return addresses in the kernel.
struct Finding {
  Fault fault = Fault::kRace;
  const void* place = nullptr;
  const void* other_place = nullptr;
  std::string what;  // the first of them in words
  uint64_t count = 1;
};

// Alike ones are counted.
class Findings {
 public:
  void Add(Fault fault, const void* place, const void* other_place, const std::string& what);
  std::vector<Finding> all() const;
  bool empty() const { return findings_.empty(); }

 private:
  std::map<std::tuple<Fault, const void*, const void*>, Finding> findings_;
};

}  // namespace drape::emulator
