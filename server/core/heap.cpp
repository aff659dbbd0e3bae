#include "server/core/heap.h"

#include <cstdlib>  // defines __GLIBC__
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace drape {

void KeepFreedMemory() {
#if defined(__GLIBC__)
  // Sets both, because glibc stops adapting either threshold once one is set. A heap that replaces
  // glibc's, such as a sanitizer's, refuses and stays as it was.
  (void)mallopt(M_MMAP_THRESHOLD, static_cast<int>(kLargestKeptBlock_bytes));
  (void)mallopt(M_TRIM_THRESHOLD, static_cast<int>(kKeptPerHeap_bytes));
#endif
}

}  // namespace drape
