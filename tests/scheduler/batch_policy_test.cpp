#include "server/scheduler/batch_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <vector>

namespace drape {
namespace {

// A request whose cloths occupy `costs` each.
RunnableRequest Of(uint32_t session, uint32_t cloths, uint64_t last_round, uint32_t costs = 1) {
  static std::map<uint32_t, std::vector<uint32_t>> rows;
  std::vector<uint32_t>& row = rows[costs];
  if (row.empty()) row.assign(1000, costs);
  return {session, std::span(row).first(cloths), last_round};
}

uint32_t TakenBy(const BatchChoice& choice, uint32_t request) {
  for (const BatchTake& take : choice.takes) {
    if (take.request == request) return take.count;
  }
  return 0;
}

uint32_t Total(const BatchChoice& choice) {
  uint32_t total = 0;
  for (const BatchTake& take : choice.takes) total += take.count;
  return total;
}

TEST(BatchPolicy, NothingWaitsNothingIsTaken) {
  EXPECT_TRUE(SelectBatch({}, {}, {}).takes.empty());
}

TEST(BatchPolicy, EverybodyWhoFitsIsTakenWhole) {
  const std::vector<RunnableRequest> requests{Of(0, 5, 0), Of(1, 7, 0), Of(0, 4, 0)};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cost = 16, .quantum = 1});
  ASSERT_EQ(choice.takes.size(), 3u);
  EXPECT_EQ(TakenBy(choice, 0), 5u);
  EXPECT_EQ(TakenBy(choice, 1), 7u);
  EXPECT_EQ(TakenBy(choice, 2), 4u);
}

TEST(BatchPolicy, SessionsShareAFullBatchEvenly) {
  // Session 0 has ten times the requests of session 1.
  std::vector<RunnableRequest> requests(10, Of(0, 100, 0));
  requests.push_back(Of(1, 100, 0));
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cost = 100, .quantum = 10});
  EXPECT_EQ(Total(choice), 100u);
  EXPECT_EQ(TakenBy(choice, 10), 50u);
}

TEST(BatchPolicy, SessionsShareAFullBatchByTheirWeights) {
  // Over many batches, of which none holds a whole round of turns.
  const std::vector<uint32_t> weights{1, 2, 5};
  std::vector<RunnableRequest> requests;
  for (uint32_t session = 0; session < 3; ++session) {
    requests.push_back(Of(session, 1000, 0));
    requests.back().weight = weights[session];
  }
  FairShare share;
  std::vector<uint32_t> taken(3, 0);
  for (int batch = 0; batch < 1000; ++batch) {
    BatchChoice choice = SelectBatch(requests, share, {.max_cost = 37, .quantum = 10});
    EXPECT_EQ(Total(choice), 37u);
    for (uint32_t r = 0; r < 3; ++r) taken[r] += TakenBy(choice, r);
    share = std::move(choice.share);
  }
  // No session is ahead or behind by more than a turn.
  for (uint32_t r = 0; r < 3; ++r) EXPECT_NEAR(taken[r], 37'000.0 * weights[r] / 8, 10 * 5);
}

TEST(BatchPolicy, CostThatOneSessionDoesNotNeedGoesToTheOthers) {
  const std::vector<RunnableRequest> requests{Of(0, 3, 0), Of(1, 100, 0), Of(2, 100, 0)};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cost = 63, .quantum = 10});
  EXPECT_EQ(TakenBy(choice, 0), 3u);
  EXPECT_EQ(TakenBy(choice, 1), 30u);
  EXPECT_EQ(TakenBy(choice, 2), 30u);
}

TEST(BatchPolicy, ATurnThatWasCutShortGoesOnInTheNextBatch) {
  const std::vector<RunnableRequest> requests{Of(0, 100, 0), Of(1, 100, 0)};
  const BatchLimits limits{.max_cost = 15, .quantum = 10};
  const BatchChoice first = SelectBatch(requests, {}, limits);
  EXPECT_EQ(TakenBy(first, 0), 10u);
  EXPECT_EQ(TakenBy(first, 1), 5u);
  const BatchChoice second = SelectBatch(requests, first.share, limits);
  EXPECT_EQ(TakenBy(second, 0), 10u);  // after the 5 that session 1 had left
  EXPECT_EQ(TakenBy(second, 1), 5u);
  EXPECT_EQ(second.share.first_session, 1u);  // session 0 was full exactly at the end of its turn
}

TEST(BatchPolicy, InsideASessionTheLongestWaitGoesFirst) {
  const std::vector<RunnableRequest> requests{Of(0, 4, 9), Of(0, 4, 3), Of(0, 4, 3)};
  const BatchChoice choice = SelectBatch(requests, {}, {.max_cost = 6, .quantum = 100});
  EXPECT_EQ(TakenBy(choice, 0), 0u);
  EXPECT_EQ(TakenBy(choice, 1), 4u);  // equal: in order of arrival
  EXPECT_EQ(TakenBy(choice, 2), 2u);
}

// Random loads, always more than fits: the batch is full, nobody gets more than is there, and each
// request takes part before T * R * ceil(largest / quantum) turns are over. A batch of m costs
// holds at least floor(m / quantum) turns, so the bound in batches follows.
TEST(BatchPolicy, NobodyWaitsForEver) {
  std::mt19937 generator(7);
  const auto below = [&](uint32_t limit) { return static_cast<uint32_t>(generator() % limit); };
  for (int scenario = 0; scenario < 50; ++scenario) {
    const uint32_t sessions = 1 + below(5);
    const uint32_t per_session = 1 + below(4);
    const uint32_t largest = 1 + below(40);
    const BatchLimits limits{.max_cost = 8, .quantum = 1 + below(8)};
    std::vector<RunnableRequest> requests;
    for (uint32_t r = 0; r < sessions * per_session; ++r) {
      requests.push_back(Of(r % sessions, 1 + below(largest), 0));
    }
    const uint32_t turns =
        sessions * per_session * ((largest + limits.quantum - 1) / limits.quantum);
    const uint64_t bound = turns / (limits.max_cost / limits.quantum) + 1;
    FairShare share;
    for (uint64_t round = 1; round <= 200; ++round) {
      const BatchChoice choice = SelectBatch(requests, share, limits);
      share = choice.share;
      uint32_t waiting = 0;
      for (const RunnableRequest& request : requests) {
        waiting += static_cast<uint32_t>(request.costs.size());
      }
      ASSERT_EQ(Total(choice), std::min(waiting, limits.max_cost));
      for (const BatchTake& take : choice.takes) {
        ASSERT_GT(take.count, 0u);
        ASSERT_LE(take.count, requests[take.request].costs.size());
        requests[take.request].last_round = round;
      }
      for (const RunnableRequest& request : requests) {
        ASSERT_LE(round - request.last_round, bound) << "scenario " << scenario;
      }
    }
  }
}

// Session 0 has costly cloths, each a batch of its own: session 1 waits for one of them at most.
TEST(BatchPolicy, CostlyClothsDoNotHoldUpOthers) {
  const std::vector<RunnableRequest> requests{Of(0, 50, 0, 20), Of(1, 3, 0)};
  const BatchLimits limits{.max_cost = 16, .quantum = 4};
  FairShare share;
  uint32_t last_round = 0, costly = 0;
  for (uint32_t round = 1; round <= 40; ++round) {
    const BatchChoice choice = SelectBatch(requests, share, limits);
    share = choice.share;
    ASSERT_LE(TakenBy(choice, 0), 1u);
    ASSERT_TRUE(TakenBy(choice, 0) == 0 || TakenBy(choice, 1) == 0) << "no room beside it";
    costly += TakenBy(choice, 0);
    if (TakenBy(choice, 1) == 0) continue;
    EXPECT_EQ(TakenBy(choice, 1), 3u);
    EXPECT_LE(round - last_round, 2u);
    last_round = round;
  }
  EXPECT_EQ(costly, 20u);
}

// Random costs: a batch is never empty, never holds more than its costs unless it is a single
// cloth, and each request takes part before T * R * ceil(largest / quantum) turns are over. A turn
// takes fewer costs than a quantum and the costliest cloth, and a batch takes at least one.
TEST(BatchPolicy, NobodyWaitsForEverWhateverTheCosts) {
  std::mt19937 generator(11);
  const auto below = [&](uint32_t limit) { return static_cast<uint32_t>(generator() % limit); };
  for (int scenario = 0; scenario < 30; ++scenario) {
    const uint32_t sessions = 1 + below(3), per_session = 1 + below(3);
    const BatchLimits limits{.max_cost = 8, .quantum = 1 + below(8)};
    std::vector<std::vector<uint32_t>> costs(sessions * per_session);
    std::vector<RunnableRequest> requests;
    uint32_t largest = 0;
    constexpr uint32_t kCostliest = 12;
    for (uint32_t r = 0; r < costs.size(); ++r) {
      for (uint32_t k = 0; k <= below(6); ++k) costs[r].push_back(1 + below(kCostliest));
      largest = std::max(largest, std::accumulate(costs[r].begin(), costs[r].end(), 0u));
      requests.push_back({r % sessions, costs[r], 0});
    }
    const uint64_t turns =
        sessions * per_session * ((largest + limits.quantum - 1) / limits.quantum);
    const uint64_t bound = turns * (limits.quantum + kCostliest) + 1;
    FairShare share;
    for (uint64_t round = 1; round <= 2 * bound; ++round) {
      const BatchChoice choice = SelectBatch(requests, share, limits);
      share = choice.share;
      uint64_t taken = 0;
      for (const BatchTake& take : choice.takes) {
        const auto of_request = requests[take.request].costs;
        ASSERT_LE(take.count, of_request.size());
        for (uint32_t k = 0; k < take.count; ++k) taken += of_request[k];
        requests[take.request].last_round = round;
      }
      ASSERT_GT(Total(choice), 0u);
      ASSERT_TRUE(taken <= limits.max_cost || Total(choice) == 1);
      for (const RunnableRequest& request : requests) {
        ASSERT_LE(round - request.last_round, bound) << "scenario " << scenario;
      }
    }
  }
}

}  // namespace
}  // namespace drape
