// When the process's heap gives memory back to the system.
#pragma once

#include <cstddef>

namespace drape {

// Freed blocks below this size are kept; larger ones return to the system at once.
inline constexpr size_t kLargestKeptBlock_bytes = size_t{32} << 20;
// Freed memory that is kept at the end of a heap (glibc has several, each shared by some threads).
inline constexpr size_t kKeptPerHeap_bytes = size_t{64} << 20;

// Applies both to the whole process; call it once, at its start. Otherwise glibc returns the memory
// of every larger answer as soon as it has been sent, and each page has to be cleared and mapped
// again for the next one: for an answer of 0.8 MB this took 0.5 ms beside a step of 4 ms. Does
// nothing if the heap is not glibc's.
void KeepFreedMemory();

}  // namespace drape
