// The best that a core can do, in the vector registers of the backend's lanes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace drape::bench {

enum class CpuOperation {
  kCopy,         // a buffer to another; rate in bytes read and written
  kMultiplyAdd,  // a * b, then + c, each rounded, as the solver does; in floating-point operations
  kFusedMultiplyAdd,  // rounded once; in floating-point operations (2 each)
  kDivide,            // in numbers
  kSquareRoot,        // in numbers
};

struct CpuRun {
  CpuOperation operation = CpuOperation::kCopy;
  uint32_t threads = 1;
  size_t buffer_bytes = 0;  // of kCopy: both buffers of a thread together
  double seconds = 0.1;     // of each of the repeats, about
};

// Per second, all threads together; the best of three repeats.
double MeasureCpuRate(const CpuRun& run);

// "AVX3, 16 lanes".
std::string CpuLanesName();

}  // namespace drape::bench
