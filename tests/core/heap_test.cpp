#include "server/core/heap.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>
#include <vector>

namespace drape {
namespace {

constexpr size_t kBlock_bytes = size_t{1} << 20;
constexpr size_t kBlocks = 8;  // at once: more than glibc keeps by default after blocks of 1 MiB

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsHeapReplaced = true;
#else
constexpr bool kIsHeapReplaced = false;
#endif

int64_t PageFaults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// Page faults of filling blocks of a few buffers, and freeing them.
int64_t FaultsOfUse() {
  const int64_t before = PageFaults();
  std::vector<std::unique_ptr<char[]>> blocks;
  for (size_t k = 0; k < kBlocks; ++k) {
    blocks.push_back(std::make_unique_for_overwrite<char[]>(kBlock_bytes));
    std::memset(blocks.back().get(), static_cast<int>(k), kBlock_bytes);
  }
  return PageFaults() - before;
}

TEST(KeepFreedMemory, WhatIsUsedAgainTakesNoPageFaults) {
  if (kIsHeapReplaced) GTEST_SKIP() << "the sanitizer has a heap of its own";
  KeepFreedMemory();
  FaultsOfUse();
  const int64_t pages = kBlocks * kBlock_bytes / 4096;
  for (int k = 0; k < 3; ++k) EXPECT_LT(FaultsOfUse(), pages / 100);
}

}  // namespace
}  // namespace drape
