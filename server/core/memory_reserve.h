// What is done when the memory has no room left.
//
// A request that does not get its memory fails alone: what works for requests runs in WithinMemory.
// Everything else (answers to them, rounds of the device, gRPC) goes on with a reserve, which is
// given up at the first allocation that fails anywhere, and taken back as soon as what failed has
// freed its own. Until it is there again, budgets of bytes refuse (ByteBudget), so that what has
// been given up is not taken by the next request.
#pragma once

#include <cstdint>
#include <new>

#include "server/core/status.h"

namespace drape {

// RESOURCE_EXHAUSTED (DEVICE_MEMORY).
Status OutOfMemory();

// Address space that nobody has touched; it costs no pages. Thread-safe.
class MemoryReserve {
 public:
  // Of the whole process, from now on; call it once, at its start. Takes the place of
  // std::set_new_handler's. `bytes`: what the process needs to end what has been begun.
  static void Keep(uint64_t bytes);
  // Whether the process has a reserve, or gets it again now, or a part of it, or never had one.
  static bool IsThere();
  // The same, after an attempt to have the whole again, if it is not there.
  static bool Renew();
  // How often it was given up.
  static uint64_t times_used();
};

// While it exists, allocations of this thread that fail take a small part of the reserve at most,
// and only once: enough to end in order. The next one throws.
class RequestMemoryScope {
 public:
  RequestMemoryScope();
  ~RequestMemoryScope();
  RequestMemoryScope(const RequestMemoryScope&) = delete;
  RequestMemoryScope& operator=(const RequestMemoryScope&) = delete;
};

// The outcome of `work`, a Status or a Result, or OutOfMemory if it did not get its memory.
template <class Work>
auto WithinMemory(Work&& work) -> decltype(work()) {
  try {
    const RequestMemoryScope scope;
    return work();
  } catch (const std::bad_alloc&) {  // not the end of all others
    (void)MemoryReserve::IsThere();
    return OutOfMemory();
  }
}

}  // namespace drape
