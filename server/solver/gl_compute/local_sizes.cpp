#include "server/solver/gl_compute/local_sizes.h"

#include <algorithm>

#include "server/core/check.h"

namespace drape {

namespace {

constexpr DeviceSizes kTable[] = {
    // llvmpipe runs a work group on one core, in vectors of 8 invocations. It switches between
    // several vectors at each barrier, which slows small cloths. Fewer invocations mean longer
    // loops, and a dispatch may have 65535 passes (server/gl/drivers.md); so large resident cloths,
    // where the difference is a few percent, keep 32. Tiled cloths have no barriers but a cost per
    // work group.
    {.is_software = true,
     .renderer = "",
     .sizes = {.resident_64 = 8,
               .resident_256 = 8,
               .resident_512 = 32,
               .resident_1024 = 32,
               .tiled = 128,
               .refine = 32,
               .contacts = 32,
               .general = 32}},
    // One per particle in resident cloths: on an H200 a multiprocessor runs one group of a large
    // cloth at a time, for want of shared memory (server/gl/drivers.md), so that each stage needs
    // many invocations to hide its latencies (tests/bench/results/h200). Those of tiled cloths are
    // not measured since strips have work groups of their own. `drape_bench speed
    // --parts=local_sizes` measures them, also as a
    // part of tests/bench/gpu_round.sh; a device that wants others gets a row of its own above.
    {.is_software = false,
     .renderer = "",
     .sizes = {.resident_64 = 64,
               .resident_256 = 256,
               .resident_512 = 512,
               .resident_1024 = 1024,
               .tiled = 256,
               .refine = 1024,
               .contacts = 256,
               .general = 256}},
};

}  // namespace

uint32_t LocalSizes::ForCapacity(uint32_t capacity) const {
  if (capacity == 0) return tiled;
  if (capacity <= 64) return resident_64;
  if (capacity <= 256) return resident_256;
  return capacity <= 512 ? resident_512 : resident_1024;
}

std::span<const DeviceSizes> MeasuredLocalSizes() {
  return kTable;
}

const LocalSizes& FindLocalSizes(std::span<const DeviceSizes> table, bool is_software,
                                 std::string_view renderer) {
  const auto row = std::ranges::find_if(table, [&](const DeviceSizes& candidate) {
    return candidate.is_software == is_software &&
           renderer.find(candidate.renderer) != std::string_view::npos;
  });
  DRAPE_CHECK(row != table.end(), "no row for any device of this kind");
  return row->sizes;
}

}  // namespace drape
