#include "server/core/heap.h"

#include <cstdlib>  // whether it is glibc
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "server/core/check.h"

namespace drape {

void KeepFreedMemory() {
#if defined(__GLIBC__)
  // Both: a threshold that is set ends that glibc adapts the other one.
  const bool is_set = mallopt(M_MMAP_THRESHOLD, static_cast<int>(kLargestKeptBlock_bytes)) == 1 &&
                      mallopt(M_TRIM_THRESHOLD, static_cast<int>(kKeptPerHeap_bytes)) == 1;
  DRAPE_CHECK(is_set, "within glibc's limits");
#endif
}

}  // namespace drape
