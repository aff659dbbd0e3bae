#include "client/src/heap_thresholds.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>
#include <vector>

namespace drape {
namespace {

constexpr size_t kBlock_bytes = size_t{1} << 20;
constexpr size_t kBlocks = 8;  // at once: more than glibc keeps by default after blocks of 1 MiB

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
constexpr bool kAdapts = false;
#else
constexpr bool kAdapts = true;
#endif

// Page faults of filling blocks as large as answers, and freeing them.
int64_t FaultsOfUse() {
  const auto now = [] {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt;
  };
  const int64_t before = now();
  std::vector<std::unique_ptr<char[]>> blocks;
  for (size_t k = 0; k < kBlocks; ++k) {
    blocks.push_back(std::make_unique_for_overwrite<char[]>(kBlock_bytes));
    std::memset(blocks.back().get(), static_cast<int>(k), kBlock_bytes);
  }
  return now() - before;
}

TEST(HeapThresholds, AnswersOneAfterTheOtherTakeNoPageFaults) {
  if (!kAdapts) GTEST_SKIP() << "the heap is not glibc's";
  RaiseHeapThresholds();
  FaultsOfUse();
  constexpr int64_t kPages = kBlocks * kBlock_bytes / 4096;
  for (int k = 0; k < 3; ++k) EXPECT_LT(FaultsOfUse(), kPages / 100);
}

}  // namespace
}  // namespace drape
