#include "server/scheduler/batch_policy.h"

#include <algorithm>
#include <numeric>

namespace drape {
namespace {

// The requests of one session in the order in which they are served.
struct SessionQueue {
  std::vector<uint32_t> requests;
  size_t next = 0;  // the first one that is not wholly taken

  bool is_empty() const { return next == requests.size(); }
};

std::vector<SessionQueue> QueuesBySession(std::span<const RunnableRequest> requests) {
  std::vector<SessionQueue> queues;
  for (uint32_t r = 0; r < requests.size(); ++r) {
    if (requests[r].session >= queues.size()) queues.resize(requests[r].session + 1);
    queues[requests[r].session].requests.push_back(r);
  }
  for (SessionQueue& queue : queues) {
    std::stable_sort(queue.requests.begin(), queue.requests.end(), [&](uint32_t a, uint32_t b) {
      return requests[a].last_round < requests[b].last_round;
    });
  }
  return queues;
}

// A batch that is being filled.
struct OpenBatch {
  std::span<const RunnableRequest> requests;
  uint64_t cost_left = 0;
  std::vector<uint32_t> taken;  // [request] cloths
  bool is_empty = true;

  // Cost of the next cloth of a queue that is not empty.
  uint64_t NextCost(const SessionQueue& queue) const {
    const uint32_t r = queue.requests[queue.next];
    return requests[r].costs[taken[r]];
  }
  // A cloth that costs more than a whole batch has one of its own.
  bool Fits(uint64_t cost) const { return cost <= cost_left || is_empty; }
  void TakeNext(SessionQueue& queue) {
    const uint32_t r = queue.requests[queue.next];
    cost_left -= std::min(cost_left, NextCost(queue));
    is_empty = false;
    if (++taken[r] == requests[r].costs.size()) ++queue.next;
  }
};

// The round robin proper, for when not all cloths fit. It ends because more is wanted than fits.
FairShare ShareOut(FairShare share, uint32_t quantum, OpenBatch& batch) {
  std::vector<SessionQueue> queues = QueuesBySession(batch.requests);
  const auto session_count = static_cast<uint32_t>(queues.size());
  share.deficits.resize(session_count, 0);
  share.first_session %= session_count;
  while (true) {
    SessionQueue& queue = queues[share.first_session];
    uint64_t& deficit = share.deficits[share.first_session];
    if (!share.has_turn_begun && !queue.is_empty()) {
      deficit += uint64_t{quantum} * batch.requests[queue.requests[queue.next]].weight;
    }
    share.has_turn_begun = true;
    while (!queue.is_empty() && batch.NextCost(queue) <= deficit) {
      if (!batch.Fits(batch.NextCost(queue))) return share;
      deficit -= batch.NextCost(queue);
      batch.TakeNext(queue);
    }
    // A session with nothing left to do keeps no unused cost.
    if (queue.is_empty()) deficit = 0;
    share.first_session = (share.first_session + 1) % session_count;
    share.has_turn_begun = false;
    if (batch.cost_left == 0) return share;
  }
}

}  // namespace

BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits) {
  BatchChoice choice;
  choice.share = share;
  uint64_t wanted = 0;
  for (const RunnableRequest& request : requests) {
    wanted = std::accumulate(request.costs.begin(), request.costs.end(), wanted);
  }
  OpenBatch batch{requests, limits.max_cost, std::vector<uint32_t>(requests.size(), 0)};
  if (wanted <= limits.max_cost) {
    for (size_t r = 0; r < requests.size(); ++r) {
      batch.taken[r] = static_cast<uint32_t>(requests[r].costs.size());
    }
    choice.share = {share.first_session, false, {}};  // no session has to wait: all start again
  } else {
    choice.share = ShareOut(share, limits.quantum, batch);
  }
  for (uint32_t r = 0; r < requests.size(); ++r) {
    if (batch.taken[r] > 0) choice.takes.push_back({r, batch.taken[r]});
  }
  return choice;
}

}  // namespace drape
