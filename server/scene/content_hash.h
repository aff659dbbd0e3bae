// Equality of content, for objects shared by equal requests. Arrays are compared bit for bit: their
// elements must have no padding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace drape {

// FNV-1a, folding eight bytes at a time with the trailing bytes one by one.
class ContentHash {
 public:
  template <class T>
  void Add(const std::vector<T>& values) {
    AddWord(values.size());
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    const size_t size = values.size() * sizeof(T);
    size_t at = 0;
    for (; at + sizeof(uint64_t) <= size; at += sizeof(uint64_t)) {
      uint64_t word;
      std::memcpy(&word, bytes + at, sizeof(word));
      AddWord(word);
    }
    for (; at < size; ++at) AddWord(bytes[at]);
  }
  void AddWord(uint64_t word) {
    hash_ = (hash_ ^ word) * 0x100000001b3u;
    hash_ ^= hash_ >> 32;  // whole words reach only upwards in a product
  }
  uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325u;
};

template <class T>
bool SameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace drape
