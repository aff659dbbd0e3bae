#include "client/src/heap_thresholds.h"

#include <gtest/gtest.h>

#include "tests/support/page_faults.h"

namespace drape {
namespace {

TEST(HeapThresholds, AnswersOneAfterTheOtherTakeNoPageFaults) {
  if (!test::kHasGlibcHeap) GTEST_SKIP() << "the heap is not glibc's";
  RaiseHeapThresholds();
  test::FaultsOfAnswers();
  for (int k = 0; k < 3; ++k) EXPECT_LT(test::FaultsOfAnswers(), test::kAnswerPages / 100);
}

}  // namespace
}  // namespace drape
