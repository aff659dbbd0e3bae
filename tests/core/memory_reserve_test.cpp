#include "server/core/memory_reserve.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdlib>
#include <vector>

#include "server/core/byte_budget.h"
#include "tests/support/page_faults.h"

namespace drape {
namespace {

constexpr uint64_t kReserve_bytes = uint64_t{64} << 20;
constexpr uint64_t kBlock_bytes = uint64_t{1} << 20;

// With nothing left but the reserve. In a process of its own: the limit cannot be raised again.
void UseUpAllMemory() {
  MemoryReserve::Keep(kReserve_bytes);
  rlimit limit{};
  limit.rlim_cur = limit.rlim_max = kReserve_bytes + (uint64_t{256} << 20);
  setrlimit(RLIMIT_DATA, &limit);
  while (std::malloc(kBlock_bytes) != nullptr) {
  }
}

[[noreturn]] void EndWith(bool is_good) {
  std::_Exit(is_good ? 0 : 1);
}

class OutOfMemoryDeathTest : public testing::Test {
  void SetUp() override {
    if (!test::kHasGlibcHeap) GTEST_SKIP() << "a sanitizer's heap knows no limit";
    GTEST_FLAG_SET(death_test_style, "threadsafe");
  }
};

TEST_F(OutOfMemoryDeathTest, ARequestFailsAlone) {
  EXPECT_EXIT(
      {
        UseUpAllMemory();
        const Status status = WithinMemory([] {
          const std::vector<char> much(8 * kBlock_bytes);
          return Status::Ok();
        });
        EndWith(status.code() == StatusCode::kResourceExhausted &&
                status.reason() == "DEVICE_MEMORY");
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(OutOfMemoryDeathTest, WhatMustGoOnHasTheReserve) {
  EXPECT_EXIT(
      {
        UseUpAllMemory();
        const std::vector<char> some(kBlock_bytes);
        EndWith(MemoryReserve::times_used() == 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(OutOfMemoryDeathTest, BudgetsRefuseUntilTheReserveIsThereAgain) {
  EXPECT_EXIT(
      {
        void* volatile much = std::malloc(2 * kReserve_bytes);
        UseUpAllMemory();
        { const std::vector<char> some(kBlock_bytes); }
        void* volatile rest =
            std::malloc(kReserve_bytes - 2 * kBlock_bytes);  // others have it meanwhile
        ByteBudget budget("TOO_MANY", {"some", 100}, {"all", 100}, 200);
        const auto refused = budget.Take("a", 1);
        std::free(much);
        const auto taken = budget.Take("a", 1);
        EndWith(rest != nullptr && refused.status().reason() == "DEVICE_MEMORY" &&
                refused.status().retry_after_ms() == 200 && taken.ok());
      },
      testing::ExitedWithCode(0), "");
}

TEST(WithinMemory, GivesTheOutcomeOfTheWork) {
  EXPECT_TRUE(WithinMemory([] { return Status::Ok(); }).ok());
  EXPECT_EQ(*WithinMemory([] { return Result<int>(3); }), 3);
  const auto failed = WithinMemory([]() -> Result<int> { throw std::bad_alloc(); });
  EXPECT_EQ(failed.status().reason(), "DEVICE_MEMORY");
}

}  // namespace
}  // namespace drape
