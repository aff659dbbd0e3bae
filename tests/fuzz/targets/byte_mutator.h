// Random changes of bytes that keep most of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>

namespace drape::test {

// Changes, removes, repeats or inserts a few bytes.
class ByteMutator {
 public:
  explicit ByteMutator(uint32_t seed) : random_(seed) {}

  std::string Mutate(std::string bytes) {
    const uint32_t changes = 1 + Below(4);
    for (uint32_t k = 0; k < changes && !bytes.empty(); ++k) MutateOnce(bytes);
    return bytes;
  }
  uint32_t Below(size_t bound) { return static_cast<uint32_t>(random_() % bound); }

 private:
  void MutateOnce(std::string& bytes) {
    // Boundaries of varints, signs and exponents cause most surprises.
    static const std::string kBytes("\x00\x01\x7F\x80\xFF\xF0\xF8\x3F", 8);
    const size_t at = Below(bytes.size());
    const size_t length = 1 + Below(std::min<size_t>(bytes.size() - at, 16));
    switch (Below(5)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << Below(8)));
        break;
      case 1:
        bytes[at] = kBytes[Below(kBytes.size())];
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        bytes.insert(at, std::string(length, kBytes[Below(kBytes.size())]));
        break;
    }
  }

  std::mt19937 random_;
};

}  // namespace drape::test
