// How the process's heap gives memory back to the system.
#pragma once

#include <cstddef>

namespace drape {

// Blocks below this are kept when they are freed; larger ones go back to the system at once.
inline constexpr size_t kLargestKeptBlock_bytes = size_t{32} << 20;
// Freed memory at the end of a heap (glibc has several, one per some threads) that is kept.
inline constexpr size_t kKeptPerHeap_bytes = size_t{64} << 20;

// Of the whole process, from now on; once, at its start. Without it glibc gives the memory of every
// larger answer back as soon as it has been sent, and each of its pages has to be cleared and
// mapped again for the next one: for an answer of 0.8 MB that took 0.5 ms beside a step of 4 ms.
// Does nothing where the heap is not glibc's.
void KeepFreedMemory();

}  // namespace drape
