#include "server/scheduler/batch_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace drape {
namespace {

uint32_t TakenBy(const BatchChoice& choice, uint32_t request) {
  for (const BatchTake& take : choice.takes) {
    if (take.request == request) return take.cloth_count;
  }
  return 0;
}

uint32_t Total(const BatchChoice& choice) {
  uint32_t total = 0;
  for (const BatchTake& take : choice.takes) total += take.cloth_count;
  return total;
}

TEST(BatchPolicy, NothingWaitsNothingIsTaken) {
  EXPECT_TRUE(SelectBatch({}, {}, {}).takes.empty());
}

TEST(BatchPolicy, EverybodyWhoFitsIsTakenWhole) {
  const std::vector<RunnableRequest> requests{{0, 5, 0}, {1, 7, 0}, {0, 4, 0}};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cloths = 16, .quantum_cloths = 1});
  ASSERT_EQ(choice.takes.size(), 3u);
  EXPECT_EQ(TakenBy(choice, 0), 5u);
  EXPECT_EQ(TakenBy(choice, 1), 7u);
  EXPECT_EQ(TakenBy(choice, 2), 4u);
}

TEST(BatchPolicy, TenantsShareAFullBatchEvenly) {
  // Tenant 0 has ten times the requests of tenant 1.
  std::vector<RunnableRequest> requests(10, RunnableRequest{0, 100, 0});
  requests.push_back({1, 100, 0});
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cloths = 100, .quantum_cloths = 10});
  EXPECT_EQ(Total(choice), 100u);
  EXPECT_EQ(TakenBy(choice, 10), 50u);
}

TEST(BatchPolicy, PlacesThatOneTenantDoesNotNeedGoToTheOthers) {
  const std::vector<RunnableRequest> requests{{0, 3, 0}, {1, 100, 0}, {2, 100, 0}};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cloths = 63, .quantum_cloths = 10});
  EXPECT_EQ(TakenBy(choice, 0), 3u);
  EXPECT_EQ(TakenBy(choice, 1), 30u);
  EXPECT_EQ(TakenBy(choice, 2), 30u);
}

TEST(BatchPolicy, ATurnThatWasCutShortGoesOnInTheNextBatch) {
  const std::vector<RunnableRequest> requests{{0, 100, 0}, {1, 100, 0}};
  const BatchLimits limits{.max_cloths = 15, .quantum_cloths = 10};
  const BatchChoice first = SelectBatch(requests, {}, limits);
  EXPECT_EQ(TakenBy(first, 0), 10u);
  EXPECT_EQ(TakenBy(first, 1), 5u);
  const BatchChoice second = SelectBatch(requests, first.share, limits);
  EXPECT_EQ(TakenBy(second, 0), 10u);  // after the 5 that tenant 1 had left
  EXPECT_EQ(TakenBy(second, 1), 5u);
  EXPECT_EQ(second.share.first_tenant, 1u);  // tenant 0 was full exactly at the end of its turn
}

TEST(BatchPolicy, InsideATenantTheLongestWaitGoesFirst) {
  const std::vector<RunnableRequest> requests{{0, 4, 9}, {0, 4, 3}, {0, 4, 3}};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cloths = 6, .quantum_cloths = 100});
  EXPECT_EQ(TakenBy(choice, 0), 0u);
  EXPECT_EQ(TakenBy(choice, 1), 4u);  // equal: in order of arrival
  EXPECT_EQ(TakenBy(choice, 2), 2u);
}

// Random loads, always more than fits: the batch is full, nobody gets more than is there, and each
// request takes part before T * R * ceil(largest / quantum) turns are over. A batch of m places
// holds at least floor(m / quantum) turns, so the bound in batches follows.
TEST(BatchPolicy, NobodyWaitsForEver) {
  std::mt19937 generator(7);
  const auto below = [&](uint32_t limit) { return static_cast<uint32_t>(generator() % limit); };
  for (int scenario = 0; scenario < 50; ++scenario) {
    const uint32_t tenants = 1 + below(5);
    const uint32_t per_tenant = 1 + below(4);
    const uint32_t largest = 1 + below(40);
    const BatchLimits limits{.max_cloths = 8, .quantum_cloths = 1 + below(8)};
    std::vector<RunnableRequest> requests;
    for (uint32_t r = 0; r < tenants * per_tenant; ++r) {
      requests.push_back({r % tenants, 1 + below(largest), 0});
    }
    const uint32_t turns =
        tenants * per_tenant * ((largest + limits.quantum_cloths - 1) / limits.quantum_cloths);
    const uint64_t bound = turns / (limits.max_cloths / limits.quantum_cloths) + 1;
    FairShare share;
    for (uint64_t round = 1; round <= 200; ++round) {
      const BatchChoice choice = SelectBatch(requests, share, limits);
      share = choice.share;
      uint32_t waiting = 0;
      for (const RunnableRequest& request : requests) waiting += request.cloth_count;
      ASSERT_EQ(Total(choice), std::min(waiting, limits.max_cloths));
      for (const BatchTake& take : choice.takes) {
        ASSERT_GT(take.cloth_count, 0u);
        ASSERT_LE(take.cloth_count, requests[take.request].cloth_count);
        requests[take.request].last_round = round;
      }
      for (const RunnableRequest& request : requests) {
        ASSERT_LE(round - request.last_round, bound) << "scenario " << scenario;
      }
    }
  }
}

}  // namespace
}  // namespace drape
