#include "client/src/heap_thresholds.h"

#include <cstddef>
#include <cstdlib>
#include <new>
#include <string_view>

namespace drape {
inline namespace client {
namespace {

// With its header below the 32 MiB at which glibc stops adapting. It is never written, so it takes
// no memory.
constexpr size_t kBlock_bytes = size_t{31} << 20;

// Whether it did.
bool FreeLargeBlock() {
  const char* const wish = std::getenv("DRAPE_MALLOPT");
  if (wish != nullptr && std::string_view(wish) == "0") return false;
  // Unlike those of new expressions, compilers do not leave calls of the functions out.
  void* const block = ::operator new(kBlock_bytes, std::nothrow);
  ::operator delete(block, std::nothrow);
  return true;
}

}  // namespace

void RaiseHeapThresholds() {
  [[maybe_unused]] static const bool has_freed = FreeLargeBlock();
}

}  // namespace client
}  // namespace drape
