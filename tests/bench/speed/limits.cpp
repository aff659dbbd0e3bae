// The machine's limits, measured in the run whose costs they explain -> speed_limits.csv.
#include <algorithm>
#include <cstdio>
#include <string>
#include <thread>

#include "tests/bench/speed/cpu_limits.h"
#include "tests/bench/speed/gl_limits.h"
#include "tests/bench/speed/speed.h"

namespace drape::bench {
namespace {

struct Limit {
  const char* name;
  CpuOperation operation;
  size_t buffer_bytes;
  const char* unit;
};
constexpr size_t kKibi = 1024;
// Sizes of both buffers together: within the first level cache (32 or 48 KiB), the second (1 MiB
// and less), the third, and beyond it.
constexpr Limit kCpuLimits[] = {
    {"copy", CpuOperation::kCopy, 16 * kKibi, "byte"},
    {"copy", CpuOperation::kCopy, 256 * kKibi, "byte"},
    {"copy", CpuOperation::kCopy, 8 * kKibi* kKibi, "byte"},
    {"copy", CpuOperation::kCopy, 512 * kKibi* kKibi, "byte"},
    {"multiply and add", CpuOperation::kMultiplyAdd, 0, "flop"},
    {"fused multiply-add", CpuOperation::kFusedMultiplyAdd, 0, "flop"},
    {"divide", CpuOperation::kDivide, 0, "number"},
    {"square root", CpuOperation::kSquareRoot, 0, "number"},
};

class LimitTable {
 public:
  explicit LimitTable(Bench& bench)
      : table_(bench.OpenTable("speed_limits", {"backend", "device", "limit", "threads",
                                                "size_bytes", "rate_per_s", "unit"})) {}

  void Add(const std::string& backend, const std::string& device, const GlRate& rate,
           uint32_t threads) {
    std::printf("    %-4s %-20s %11.0f bytes, %u threads: %.4g %s/s\n", backend.c_str(),
                rate.limit.c_str(), rate.size_bytes, threads, rate.rate, rate.unit.c_str());
    std::string name = device;
    std::ranges::replace(name, ',', ';');
    table_.Add({backend, name, rate.limit, threads, rate.size_bytes, rate.rate, rate.unit});
  }

 private:
  Table table_;
};

}  // namespace

void MeasureLimits(Bench& bench, const LimitsOptions& options) {
  const double seconds = bench.is_quick() ? 0.001 : options.seconds;
  LimitTable table(bench);
  const uint32_t cores = std::max(std::thread::hardware_concurrency(), 1u);
  for (const std::string& backend : bench.options().backends) {
    if (backend == "reference") continue;
    if (!bench.StartRow("limits of " + backend)) return;
    if (backend == "gl") {
      const GlLimits limits = MeasureGlLimits(seconds, bench.is_quick());
      for (const GlRate& rate : limits.rates) table.Add(backend, limits.device, rate, 0);
      continue;
    }
    for (const Limit& limit : kCpuLimits) {
      if (bench.is_quick() && limit.buffer_bytes > kKibi * kKibi) continue;
      for (uint32_t threads = 1; threads <= cores; threads += std::max(cores - 1, 1u)) {
        const double rate = MeasureCpuRate({limit.operation, threads, limit.buffer_bytes, seconds});
        table.Add(backend, CpuLanesName(),
                  {limit.name, static_cast<double>(limit.buffer_bytes), rate, limit.unit}, threads);
      }
    }
  }
}

}  // namespace drape::bench
