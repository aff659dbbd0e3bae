// What the heap costs a thread that uses as much memory as answers take. Header only.
#pragma once

#include <sys/resource.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace drape::test {

// Sanitizers bring one of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
inline constexpr bool kHasGlibcHeap = false;
#else
inline constexpr bool kHasGlibcHeap = true;
#endif

inline constexpr size_t kAnswer_bytes = size_t{1} << 20;
inline constexpr size_t kAnswers = 8;  // at once: more than glibc keeps after blocks of 1 MiB
inline constexpr int64_t kAnswerPages = kAnswers * kAnswer_bytes / 4096;

// Page faults of filling them all, and freeing them.
inline int64_t FaultsOfAnswers() {
  const auto faults = [] {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt;
  };
  const int64_t before = faults();
  std::vector<std::unique_ptr<char[]>> answers;
  for (size_t k = 0; k < kAnswers; ++k) {
    answers.push_back(std::make_unique_for_overwrite<char[]>(kAnswer_bytes));
    std::memset(answers.back().get(), static_cast<int>(k), kAnswer_bytes);
  }
  return faults() - before;
}

}  // namespace drape::test
