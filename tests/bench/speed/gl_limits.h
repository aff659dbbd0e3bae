// The best that an OpenGL device can do, by small shaders of the benchmark's own.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace drape::bench {

struct GlRate {
  std::string limit;  // "copy", "fused multiply-add", "shared memory", "work groups at once, ..."
  double size_bytes = 0;  // of both buffers; of the copy only
  double rate = 0;        // per second
  std::string unit;       // "byte", "flop"; "group": their number, not a rate
};

struct GlLimits {
  std::string device;
  std::vector<GlRate> rates;
};

// Uses a context of its own, hardware before software, which it destroys; the caller's context must
// be made current again. `seconds`: of each measurement, about. `quick`: buffers of a MiB.
// std::runtime_error where there is no device or a shader does not compile.
GlLimits MeasureGlLimits(double seconds, bool quick);

}  // namespace drape::bench
