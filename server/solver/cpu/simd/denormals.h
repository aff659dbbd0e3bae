// Numbers too small for full precision are taken as zero while a step is computed.
#pragma once

#include <cstdint>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace drape::cpu {

// For the calling thread, while it lives: results and operands below 1.2e-38 are 0. A strip's
// impulses fall off geometrically with the distance from an error; where they leave the normal
// range each operation would take some hundred cycles. Elsewhere than on x86 it does nothing.
class DenormalsAreZero {
 public:
#if defined(__x86_64__)
  DenormalsAreZero() : saved_(_mm_getcsr()) {
    _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero);
  }
  ~DenormalsAreZero() {
    _mm_setcsr(saved_);
  }
#else
  DenormalsAreZero() = default;
#endif
  DenormalsAreZero(const DenormalsAreZero&) = delete;
  DenormalsAreZero& operator=(const DenormalsAreZero&) = delete;

#if defined(__x86_64__)
 private:
  static constexpr uint32_t kFlushToZero = 1u << 15;
  static constexpr uint32_t kDenormalsAreZero = 1u << 6;

  const uint32_t saved_;
#endif
};

}  // namespace drape::cpu
