// Memory whose type only the code of one instruction set knows.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace drape::cpu {

// Working memory for vectors of any instruction set; keeps its size.
class SimdMemory {
 public:
  // At least this many; they keep the values of the last use.
  template <class T>
  T* Reserve(size_t count) {
    blocks_.resize(
        std::max(blocks_.size(), (count * sizeof(T) + sizeof(Block) - 1) / sizeof(Block)));
    return reinterpret_cast<T*>(blocks_.data());
  }
  // What the last call of Reserve gave.
  template <class T>
  const T* Get() const {
    return reinterpret_cast<const T*>(blocks_.data());
  }

 private:
  struct alignas(64) Block {
    std::byte bytes[64];
  };
  std::vector<Block> blocks_;
};

}  // namespace drape::cpu
