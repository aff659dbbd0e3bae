// Hashes of numbers that clients choose. Without a secret they could choose numbers that share a
// bucket, and each of a million look-ups would pass through a million others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

namespace drape {

// Another function in each process, so nothing may depend on the order of a table that it makes.
struct KeyedHash {
  size_t operator()(uint64_t number) const {
    static const uint64_t key = [] {
      std::random_device random;
      return uint64_t{random()} << 32 | random();
    }();
    // The finalizer of splitmix64: a bijection in which each bit depends on all.
    uint64_t x = number ^ key;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }
};

}  // namespace drape
