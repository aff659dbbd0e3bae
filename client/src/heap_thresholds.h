// What the heap keeps of the memory of answers.
#pragma once

namespace drape {
inline namespace client {

// Lets glibc keep freed memory for the next answer, once per process: otherwise it gives the pages
// of every larger answer back to the system, which has to clear and map them again. glibc adapts to
// the largest block (of up to 32 MiB) that a program has freed; so one is freed here. A program
// that sets M_MMAP_THRESHOLD or M_TRIM_THRESHOLD itself, before or after this, gets what it sets;
// with DRAPE_MALLOPT=0 in the environment nothing happens.
void RaiseHeapThresholds();

}  // namespace client
}  // namespace drape
