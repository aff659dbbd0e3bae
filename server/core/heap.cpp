#include "server/core/heap.h"

#include <cstdlib>  // whether it is glibc
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace drape {

void KeepFreedMemory() {
#if defined(__GLIBC__)
  // Both: a threshold that is set ends that glibc adapts the other one. Another heap in its place,
  // as that of a sanitizer, refuses, and is as good as before.
  (void)mallopt(M_MMAP_THRESHOLD, static_cast<int>(kLargestKeptBlock_bytes));
  (void)mallopt(M_TRIM_THRESHOLD, static_cast<int>(kKeptPerHeap_bytes));
#endif
}

}  // namespace drape
